//! The waves of a revolution: low orders of the driver's turn and ramps, what scatters from turn to turn.

/// Highest order of the driver's turn that scatters.
pub(super) const ORDERS: usize = 8;
/// Ramps: alone, and on cosine and sine of order 1.
const RAMPS: usize = 3;
/// Waves: the constant, cosine and sine of every order, and the ramps.
pub(super) const WAVES: usize = STEADY + RAMPS;
/// Kinds of waves: order 0 … 8, the ramp, the ramp on order 1.
pub(super) const KINDS: usize = ORDERS + 3;
/// Waves that are no ramps.
pub(super) const STEADY: usize = 2 * ORDERS + 1;
/// Waves of unit RMS at an angle and a part of the revolution, 0 to 1.
pub(super) fn waves(theta1_rad: f64, part: f64) -> [f64; WAVES] {
    let mut z = [1.0; WAVES];
    let ramp = 2.0 * 3.0_f64.sqrt() * (part - 0.5);
    for order in 1..=ORDERS {
        let (sin, cos) = (order as f64 * theta1_rad).sin_cos();
        z[2 * order - 1] = std::f64::consts::SQRT_2 * cos;
        z[2 * order] = std::f64::consts::SQRT_2 * sin;
    }
    z[STEADY] = ramp;
    z[STEADY + 1] = ramp * z[1];
    z[STEADY + 2] = ramp * z[2];
    z
}

/// Kind of a wave.
pub(super) fn kind(wave: usize) -> usize {
    match wave.checked_sub(STEADY) {
        None => wave.div_ceil(2),
        Some(0) => ORDERS + 1,
        Some(_) => ORDERS + 2,
    }
}

/// Waves of a kind.
pub(super) fn members(kind: usize) -> f64 {
    if kind == 0 || kind == ORDERS + 1 { 1.0 } else { 2.0 }
}
