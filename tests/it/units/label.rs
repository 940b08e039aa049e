use warpcheck::picture::*;

#[test]
fn wrapping_keeps_every_letter_and_the_width() {
    let text = "a rather  long label: exponent=100000000 at\nsecond line";
    for columns in 1..60 {
        let lines = wrap_text(text, columns);
        assert!(lines.iter().all(|line| line.chars().count() <= columns), "{columns} {lines:?}");
        let letters = |s: &str| s.chars().filter(|c| !c.is_whitespace()).collect::<String>();
        assert_eq!(letters(&lines.concat()), letters(text));
    }
    assert!(wrap_text("", 5).is_empty());
    let name = "environment/spruit_sunrise_512/uniform-v: pass";
    assert_eq!(wrap_text(name, 32), ["environment/spruit_sunrise_512/", "uniform-v: pass"]);
    assert_eq!(wrap_text("spruit_sunrise_512", 10), ["spruit_", "sunrise_", "512"]);
}

#[test]
fn text_is_clipped_and_unknown_signs_are_marked() {
    let mut canvas = Canvas::filled(20, 6, [0; 3]);
    draw_text(&mut canvas, 15, 3, "wide text", TextSize::LARGE, [255; 3]);
    let draw = |text: &str| {
        let mut canvas = Canvas::filled(8, 8, [0; 3]);
        draw_text(&mut canvas, 0, 0, text, TextSize::SMALL, [255; 3]);
        canvas
    };
    assert_eq!(draw("\u{4e2d}"), draw("?"));
    const SIGNS: &str = "²³´±µ×σθφχπΣ";
    for (i, letter) in SIGNS.chars().enumerate() {
        let shape = draw(&letter.to_string());
        assert!(shape != draw("?") && shape != draw(" "), "{letter}");
        assert!(SIGNS.chars().take(i).all(|other| draw(&other.to_string()) != shape), "{letter}");
    }
}
