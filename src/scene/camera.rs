//! The pinhole camera.

use super::Ray;
use glam::{DVec3, Vec3};

/// Which side of the picture the field of view spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FovAxis {
    /// The height.
    #[default]
    Vertical,
    /// The width.
    Horizontal,
    /// The shorter of the two.
    Smaller,
}

/// How a camera stands; lengths in scene units, the field of view in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where it is.
    pub eye: Vec3,
    /// What the middle of the picture shows.
    pub at: Vec3,
    /// A direction that points up in the picture.
    pub up: Vec3,
    /// The field of view, in (0, pi).
    pub fov: f32,
    /// The side that it spans.
    pub fov_axis: FovAxis,
    /// Whether left and right are exchanged, as in systems whose x axis is up x forward.
    pub mirror: bool,
}

/// A pinhole camera for a picture of a given size.
///
/// Pixel coordinates are continuous, x to the right and y down from the top left corner: pixel (i, j) covers
/// [i, i + 1) x [j, j + 1), and the middle of the picture is at (width / 2, height / 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: Vec3,
    /// Direction, not of unit length, through (0, 0), and its change for a pixel in x and y.
    corner: DVec3,
    dx: DVec3,
    dy: DVec3,
}

impl Camera {
    /// A camera, or why there is none: a sentence that begins with the word for what is wrong.
    ///
    /// ```
    /// use glam::Vec3;
    /// use warpcheck::scene::{Camera, FovAxis, View};
    /// let view = View {
    ///     eye: Vec3::ZERO,
    ///     at: Vec3::NEG_Z,
    ///     up: Vec3::Y,
    ///     fov: std::f32::consts::FRAC_PI_2,
    ///     fov_axis: FovAxis::Vertical,
    ///     mirror: false,
    /// };
    /// let camera = Camera::new(view, 200, 100).unwrap();
    /// assert_eq!(camera.ray(100.0, 50.0).direction, Vec3::NEG_Z);
    /// let right = camera.ray(200.0, 50.0).direction;
    /// assert!((right - Vec3::new(2.0, 0.0, -1.0).normalize()).length() < 1e-6);
    /// ```
    ///
    /// # Errors
    /// If `eye` and `at` coincide, `up` is zero or parallel to the view, the field of view is not in (0, pi), the
    /// picture has no pixels, or anything is not finite.
    pub fn new(view: View, width: u32, height: u32) -> Result<Self, &'static str> {
        let View { eye, at, up, fov, fov_axis, mirror } = view;
        if !(eye.is_finite() && at.is_finite() && up.is_finite()) {
            return Err("has a coordinate that is not finite");
        }
        if !(fov > 0.0 && fov < std::f32::consts::PI) {
            return Err("has a field of view that is not between 0 and 180 degrees");
        }
        if width == 0 || height == 0 {
            return Err("has a picture without pixels");
        }
        let forward = (at.as_dvec3() - eye.as_dvec3()).try_normalize();
        let forward = forward.ok_or("looks nowhere: `eye` and `at` are the same point")?;
        let up = up.as_dvec3().try_normalize().ok_or("has an `up` of length 0")?;
        let side = forward.cross(up);
        if side.length() < 1e-6 {
            return Err("has an `up` that is parallel to the direction from `eye` to `at`");
        }
        let right = side.normalize();
        let up = right.cross(forward);
        let (w, h) = (width as f64, height as f64);
        let span = match fov_axis {
            FovAxis::Vertical => h,
            FovAxis::Horizontal => w,
            FovAxis::Smaller => w.min(h),
        };
        let pixel = 2.0 * (fov as f64 / 2.0).tan() / span;
        let dx = if mirror { -right } else { right } * pixel;
        let dy = -up * pixel;
        Ok(Self { eye, corner: forward - dx * (w / 2.0) - dy * (h / 2.0), dx, dy })
    }

    /// The ray through a point of the picture; its direction is a unit vector.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let direction = self.corner + x as f64 * self.dx + y as f64 * self.dy;
        Ray::new(self.eye, direction.normalize().as_vec3())
    }

    /// Where the camera is.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Where a point of the scene stands in the picture, in continuous pixel coordinates, possibly outside its borders;
    /// `None` if it is not in front of the camera.
    pub fn pixel_of(&self, point: Vec3) -> Option<[f32; 2]> {
        // corner + x dx + y dy = s (point - eye), solved for x, y, s by Cramer's rule.
        let to = point.as_dvec3() - self.eye.as_dvec3();
        let plane = self.dx.cross(self.dy);
        let depth = to.dot(plane);
        let s = self.corner.dot(plane) / depth;
        let p = to * s - self.corner;
        let [x, y] = [self.dx, self.dy].map(|d| (p.dot(d) / d.length_squared()) as f32);
        (s > 0.0 && s.is_finite()).then_some([x, y])
    }
}
