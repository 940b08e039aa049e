//! An orthonormal frame about a unit vector, without branches or a square root.

use glam::Vec3;

/// A right-handed orthonormal frame: `tangent` x `bitangent` = `normal`.
///
/// Built after Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
///
/// ```
/// use glam::Vec3;
/// let frame = warpcheck::sampler::Frame::new(Vec3::new(0.6, 0.0, -0.8));
/// let w = Vec3::new(0.0, 0.6, 0.8);
/// assert!((frame.to_local(frame.to_world(w)) - w).length() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The local x axis.
    pub tangent: Vec3,
    /// The local y axis.
    pub bitangent: Vec3,
    /// The local z axis, as given.
    pub normal: Vec3,
}

impl Frame {
    /// The frame about `normal`, of unit length.
    #[inline]
    pub fn new(normal: Vec3) -> Self {
        let n = normal;
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            bitangent: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            normal,
        }
    }

    /// From local to world coordinates.
    #[inline]
    pub fn to_world(&self, w: Vec3) -> Vec3 {
        self.tangent * w.x + self.bitangent * w.y + self.normal * w.z
    }

    /// From world to local coordinates.
    #[inline]
    pub fn to_local(&self, w: Vec3) -> Vec3 {
        Vec3::new(w.dot(self.tangent), w.dot(self.bitangent), w.dot(self.normal))
    }
}
