//! Maps of a few texels.

use super::*;

#[test]
fn a_map_of_eight_texels() {
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let map = Environment::from_map(small_map(), rows).unwrap();
        let packed =
            [Form::Guide, Form::Alias].map(|form| PackedEnvironment::new(small_map(), rows, form).unwrap());
        assert_eq!((map.width(), map.height(), map.map().constant()), (4, 2, None));
        assert_eq!(packed.each_ref().map(PackedEnvironment::form), [Form::Guide, Form::Alias]);
        assert_eq!(map.texel(2, 1), [3.0; 3]);
        near(map.texel_mass(2, 1), 0.25, 1e-14);
        assert!(packed.iter().all(|map| (map.texel_mass(2, 1) - 0.25).abs() < 1e-9));
        for knots in [map.knots(), packed[0].knots(), packed[1].knots()] {
            assert_eq!(knots, Knots::grid(2, 4));
        }
        // Rows, and columns of the brighter one.
        for knots in
            [&|d| map.variate_knots(d), &|d| packed[0].variate_knots(d)] as [&dyn Fn(usize) -> Vec<f64>; 2]
        {
            all_near(&knots(0), &[1.0 / 3.0], 1e-9);
            all_near(&knots(1), &[0.125, 0.375, 0.75], 1e-9);
        }
        assert_eq!(packed[1].variate_knots(1), [0.0; 0]);
        assert!(packed[1].variate_knots(0).len() > 8);
        all_near(&map.marginal().variate_knots(0), &[1.0 / 3.0], 1e-15);
        all_near(&map.conditional(0).unwrap().variate_knots(0), &[0.25, 0.5, 0.75], 1e-15);
        // The middle of column 2 of the lower row, which has 2/3 of the first variate and 3/8 of the second.
        let xi = [2.0 / 3.0, 0.5625];
        let theta = match rows {
            RowWarp::UniformV => 0.75 * PI,
            RowWarp::UniformCosTheta => 2.0 / 3.0 * PI,
        };
        let density = match rows {
            RowWarp::UniformV => 0.25 * 8.0 / (2.0 * PI * PI * theta.sin()),
            RowWarp::UniformCosTheta => 0.25 / (PI / 2.0),
        };
        let direction =
            DVec3::new(theta.sin() * (1.25 * PI).cos(), theta.sin() * (1.25 * PI).sin(), theta.cos());
        for sample in [map.sample(xi), packed[0].sample(xi)] {
            all_near(&sample.uv.to_array(), &[0.625, theta / PI], 1e-8);
            assert!((sample.direction.as_dvec3() - direction).length() < 1e-7, "{sample:?}");
            near(sample.density.into(), density, 1e-6);
            assert_eq!(sample.radiance, Vec3::splat(3.0));
        }
        for found in [
            map.density(direction.as_vec3()),
            packed[0].density(direction.as_vec3()),
            packed[1].density(direction.as_vec3()),
        ] {
            near(found.into(), density, 1e-6);
        }
        // Per (u, v), per v and per u.
        let v = theta / PI;
        near(map.density_uv(DVec2::new(0.625, v)), density * TAU * PI * theta.sin(), 1e-12);
        near(map.density_u(0.625, v).unwrap(), 1.5, 1e-12);
        near(map.density_v(v), density * TAU * PI * theta.sin() / 1.5, 1e-12);
        // The last row and column have their ends.
        near(map.density_u(1.0, 1.0).unwrap(), 1.0, 1e-12);
        near(map.density_uv(DVec2::new(1.0, 0.75)), map.density_uv(DVec2::new(0.9, 0.75)), 1e-12);
        if rows == RowWarp::UniformV {
            near(map.density_v(1.0), 4.0 / 3.0, 1e-12);
        }
    }
}

/// Seven rows, seen from the nearer pole: the place in a row is linear in v, or in cos theta.
#[test]
fn places_in_rows() {
    let map = |rows| Environment::new(1, 7, vec![[1.0; 3]; 7], rows).unwrap();
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let baseline = map(rows);
        let packed = PackedEnvironment::new(baseline.map().clone(), rows, Form::Guide).unwrap();
        for row in 0..7 {
            for place in [1e-9, 0.25, 0.5, 0.9, 1.0 - 1e-9] {
                let marginal = baseline.marginal();
                let xi = marginal.cumulative(row) + place * marginal.mass(row);
                let [top, bottom] = [row, row + 1].map(|edge| edge as f64 / 7.0 * PI);
                let theta = match rows {
                    RowWarp::UniformV => top + place * (bottom - top),
                    RowWarp::UniformCosTheta => (top.cos() + place * (bottom.cos() - top.cos())).acos(),
                };
                for sample in [baseline.sample([xi, 0.3]), packed.sample([xi, 0.3])] {
                    // Off the borders by 2e-7.
                    let theta = theta.clamp(top + 2e-7, bottom - 2e-7);
                    all_near(&[PI * sample.uv.y], &[theta], 1e-8);
                    let density = match rows {
                        RowWarp::UniformV => {
                            7.0 * baseline.texel_mass(0, row) / (2.0 * PI * PI * theta.sin())
                        }
                        RowWarp::UniformCosTheta => 1.0 / (4.0 * PI),
                    };
                    near(sample.density.into(), density, 1e-6);
                    all_near(&[sample.direction.z.into()], &[theta.cos()], 1e-7);
                    all_near(&[sample.direction.truncate().length().into()], &[theta.sin()], 1e-7);
                }
            }
        }
    }
}

#[test]
fn maps_of_one_colour_and_of_two() {
    let of = |texels: Vec<[f32; 3]>| RadianceMap::new(texels.len(), 1, texels).unwrap();
    assert_eq!(of(vec![[1.0, 2.0, 3.0]; 5]).constant(), Some(Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!(of(vec![[1.0, 2.0, 3.0], [1.0, 2.0, 3.5]]).constant(), None);
    near(luminance([1.0, 0.0, 0.0]), 0.2126, 1e-15);
    near(luminance([0.0, 2.0, 0.0]), 2.0 * 0.7152, 1e-15);
    near(luminance([0.0, 0.0, 4.0]), 4.0 * 0.0722, 1e-15);
    let dark = RadianceMap::new(1, 2, vec![[0.0; 3], [1.0; 3]]).unwrap();
    let dark = Environment::from_map(dark, RowWarp::UniformV).unwrap();
    assert!(dark.conditional(0).is_none() && dark.conditional(1).is_some());
    assert_eq!((dark.density_u(0.5, 0.2), dark.texel_mass(0, 0), dark.texel_mass(0, 1)), (None, 0.0, 1.0));
    assert_eq!((dark.radiance(Vec3::Z), dark.radiance(Vec3::NEG_Z)), (Vec3::ZERO, Vec3::ONE));
    // phi = 0 is the start of the first column, and an ulp before it the end of the last.
    let columns = of((0..4).map(|i| [i as f32; 3]).collect());
    for (w, column) in [
        (Vec3::X, 0.0),
        (Vec3::new(1.0, 1e-30, 0.0), 0.0),
        (Vec3::new(1.0, -1e-30, 0.0), 3.0),
        (Vec3::Y, 1.0),
        (Vec3::NEG_Y, 3.0),
    ] {
        assert_eq!(columns.radiance(w), Vec3::splat(column), "{w}");
    }
}

/// Samples keep 2e-7 rad off the borders of columns.
#[test]
fn margins_of_columns() {
    let map = RadianceMap::new(1000, 1, vec![[1.0; 3]; 1000]).unwrap();
    let baseline = Environment::from_map(map.clone(), RowWarp::UniformV).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    for column in [0, 1, 500, 999] {
        let border = f64::from(column) / 1000.0;
        for (xi, expected) in
            [(border + 1e-9, border + 2e-7 / TAU), (border + 1e-3 - 1e-9, border + 1e-3 - 2e-7 / TAU)]
        {
            all_near(
                &[baseline.sample([0.5, xi]).uv.x, packed.sample([0.5, xi]).uv.x],
                &[expected; 2],
                1e-10,
            );
        }
    }
}

/// The masses of texels are whole numbers of 2^-53, and use up all of it.
#[test]
fn masses_of_an_alias_map_fill_it() {
    let texels: Vec<[f32; 3]> =
        (0..7 * 5).map(|i| if i % 4 == 1 { [0.0; 3] } else { [(i as f32 * 0.7).sin().abs(); 3] }).collect();
    let map = RadianceMap::new(7, 5, texels).unwrap();
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let packed = PackedEnvironment::new(map.clone(), rows, Form::Alias).unwrap();
        let steps = (0..35).map(|i| packed.texel_mass(i % 7, i / 7) * 2.0_f64.powi(53));
        let total: u64 = steps.map(|steps| steps as u64).sum();
        assert_eq!(total, 1 << 53);
    }
}

/// Texels of an alias map get as many variates as their mass says, evenly spread over their width.
#[test]
fn an_alias_map_draws_its_masses() {
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let packed = PackedEnvironment::new(small_map(), rows, Form::Alias).unwrap();
        let (points, mut counts, mut places) = (4096, [0.0; 8], [0.0; 8]);
        for k in 0..points {
            let [u, v] = packed.sample([(f64::from(k) + 0.5) / f64::from(points), 0.25]).uv.to_array();
            let texel = (4.0 * u) as usize + 4 * (2.0 * v) as usize;
            counts[texel] += 1.0;
            places[texel] += (4.0 * u).fract();
            if rows == RowWarp::UniformV {
                all_near(&[(2.0 * v).fract()], &[0.25], 1e-9);
            }
        }
        for (i, (count, place)) in counts.into_iter().zip(places).enumerate() {
            all_near(&[count / f64::from(points)], &[packed.texel_mass(i % 4, i / 4)], 2e-3);
            all_near(&[place / count], &[0.5], 0.01);
        }
    }
}

/// A texel of one of the 2^31 steps that a row has: samples are spread over all of its width. The texel of no light is no border.
#[test]
fn a_texel_of_one_step() {
    let texels = [0.0, 1.0, 1e-12].map(|x| [x; 3]);
    let map = RadianceMap::new(3, 1, texels.to_vec()).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    let step = 2.0_f64.powi(-31);
    near(packed.texel_mass(2, 0), step, 1e-12);
    for part in [0.25, 0.5, 0.75] {
        let u = packed.sample([0.5, 1.0 - step + part * step]).uv.x;
        all_near(&[u], &[(2.0 + part) / 3.0], 1e-6);
    }
    all_near(&[packed.sample([0.5, 0.5]).uv.x], &[0.5], 1e-9);
    assert_eq!(packed.variate_knots(1), [1.0 - step]);
    // Where others follow, too.
    let texels = [1.0, 1e-12, 1e-12, 1.0].map(|x| [x; 3]);
    let map = RadianceMap::new(4, 1, texels.to_vec()).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformV, Form::Guide).unwrap();
    assert_eq!([packed.texel_mass(1, 0), packed.texel_mass(2, 0)], [step; 2]);
    all_near(&DiscreteCdf::new(&[0.0, 1.0, 1.0]).unwrap().variate_knots(0), &[0.5], 1e-15);
}

/// 2^16 columns are the most that guides have place for.
#[test]
fn the_widest_map_with_guides() {
    let map = RadianceMap::new(1 << 16, 1, vec![[1.0; 3]; 1 << 16]).unwrap();
    let packed = PackedEnvironment::new(map, RowWarp::UniformCosTheta, Form::Guide).unwrap();
    for column in [0, 1, 40_000, 65_535] {
        assert_eq!(packed.texel_mass(column, 0), 1.0 / 65_536.0);
        let u = packed.sample([0.5, (column as f64 + 0.5) / 65_536.0]).uv.x;
        assert_eq!((u * 65_536.0) as usize, column);
    }
}

/// Texels and what they take; 16 bytes for each border of rows and columns.
#[test]
fn bytes_of_maps() {
    let (width, height) = (512, 8);
    let map = RadianceMap::new(width, height, vec![[1.0; 3]; width * height]).unwrap();
    let bytes = |rows, form| PackedEnvironment::new(map.clone(), rows, form).unwrap().table_bytes();
    let beside = 16 * (width + 1 + height + 1) + 8 * height;
    assert_eq!(bytes(RowWarp::UniformV, Form::Alias), 8 * width * height + beside);
    // Rows: boundaries as integers, starts as floats and five more, a guide of four buckets each. 4 bytes a texel and a line of 16 before them; 2 for the end of
    // each of 32 lines and seven more, 2 for each of as many buckets.
    let rows = 8 * height + 8 * (height + 5) + 4 * 4 * height;
    let guide = rows + 4 * 16 + height * (4 * width + 2 * (32 + 7) + 2 * 32);
    assert_eq!(bytes(RowWarp::UniformV, Form::Guide), guide + beside);
    for form in [Form::Guide, Form::Alias] {
        assert!(bytes(RowWarp::UniformCosTheta, form) >= bytes(RowWarp::UniformV, form) + 33 * height);
    }
    // Boundaries of rows and columns, and where they are.
    let baseline = Environment::from_map(map.clone(), RowWarp::UniformV).unwrap().table_bytes();
    let boundaries = 8 * width * height + 8 * height;
    assert!(baseline >= boundaries + 16 * height && baseline <= boundaries + 32 * height, "{baseline}");
}

#[test]
fn directions_of_uv() {
    for (u, v) in [(0.1, 0.2), (0.6, 0.7), (0.9, 0.01)] {
        let ((sin_phi, cos_phi), (sine, cosine)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        let expected = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
        let found = PackedEnvironment::direction_of([u, v]).as_dvec3();
        assert!((found - expected).length() < 1e-7, "{found} {expected}");
    }
}
