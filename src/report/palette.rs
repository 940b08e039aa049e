//! Colours for a few things that are to be told apart.

/// Okabe and Ito's palette, told apart by most eyes, and three more; sRGB, with their names.
pub(super) const PALETTE: [([u8; 3], &str); 9] = [
    ([0, 114, 178], "blue"),
    ([213, 94, 0], "red"),
    ([0, 158, 115], "green"),
    ([204, 121, 167], "pink"),
    ([86, 180, 233], "sky blue"),
    ([230, 159, 0], "yellow"),
    ([120, 94, 240], "violet"),
    ([120, 80, 40], "brown"),
    ([150, 150, 150], "grey"),
];
