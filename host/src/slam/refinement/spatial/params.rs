//! How all six directions of the poses are refined. Lengths in meters, angles in radians, times in seconds.

/// See the module's text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SpatialParams {
    /// Time from knot to knot. Larger: shakes are smoothed away. Smaller: more unknowns than scans.
    pub knot_s: f64,
    /// Beams used, a second and laser. Larger: slower. Smaller: fewer points on small surfaces.
    pub beams_per_s: f64,
    /// Longest range used.
    pub range_max_m: f64,
    /// Standard deviation of a range, one beam.
    pub sigma_range_m: f64,
    /// How far surfaces are from planes: plaster, mixed pixels.
    pub sigma_surface_m: f64,
    /// How wheels and tilt behave.
    pub motion: MotionSigmas,
    /// Side of a voxel in which a patch of a plane is sought. Larger: small surfaces are missed. Smaller:
    /// noise turns patches.
    pub voxel_m: f64,
    /// How far points may be from their plane, round by round. Wider at first: poses that are further off are
    /// corrected.
    pub gates_m: Vec<f64>,
    /// Near-level planes are cut into pieces of this length of the way while a ramp may be there, so that a
    /// ceiling's bend is not merged away.
    pub piece_m: f64,
}

/// Standard deviations of motions: what wheels on a ground do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionSigmas {
    /// Slip along the way, for the root of a meter.
    pub ahead_m: f64,
    /// Slip to the side.
    pub aside_m: f64,
    /// Off the ground that the tilt tells.
    pub up_m: f64,
    /// Heading, for the root of a second.
    pub turn_rad: f64,
    /// Heading, as a share of the turn.
    pub turn_share: f64,
    /// Random walk of roll, for the root of a second.
    pub tilt_rad: f64,
    /// Change of pitch from knot to knot where the ground does not bend. Larger: pitch fits noise. Smaller:
    /// bends come late.
    pub bend_rad: f64,
    /// Roll about level ground.
    pub roll_rad: f64,
    /// Pitch about level ground, which floors are where nothing says that they slope. Larger: where pitch
    /// is not seen it fits noise. Smaller: gentle ramps become level.
    pub level_rad: f64,
    /// Walls lean at most about so much.
    pub upright_rad: f64,
}

impl Default for SpatialParams {
    fn default() -> Self {
        Self {
            knot_s: 0.1,
            beams_per_s: 2500.0,
            range_max_m: 25.0,
            sigma_range_m: 0.017,
            sigma_surface_m: 0.004,
            motion: MotionSigmas {
                ahead_m: 0.0045,
                aside_m: 0.002,
                up_m: 0.001,
                turn_rad: 0.5_f64.to_radians(),
                turn_share: 0.03,
                tilt_rad: 0.7_f64.to_radians(),
                roll_rad: 1.0_f64.to_radians(),
                bend_rad: 0.06_f64.to_radians(),
                level_rad: 0.3_f64.to_radians(),
                upright_rad: 0.2_f64.to_radians(),
            },
            voxel_m: 0.4,
            gates_m: vec![0.08, 0.08, 0.08, 0.08, 0.06, 0.06],
            piece_m: 1.5,
        }
    }
}
