//! Checks of custom laws. A law is refused if its joint would silently never fail or would create
//! energy.

use super::{JointLaw, Softening};

/// Largest exponent of the pressures, powers of ten `[Pa]`, at which a law is checked.
const DECADES: i32 = 10;
/// Relative difference up to which two numbers count as equal.
const SAME: f64 = 1e-6;

/// Returns an error if a law gives values that the springs cannot use.
///
/// The springs account for all energy that they take and give, for any strengths that are numbers
/// and not negative. The residual strength must be at least the shear that dilation against the
/// pressure takes.
pub fn check(law: &dyn JointLaw) -> Result<(), String> {
    let tension = law.tension();
    expect(tension.is_finite() && tension >= 0.0, || {
        format!("tension() is {tension}, expected a finite number, 0 or more")
    })?;
    let dilation = law.tan_dilation();
    expect(dilation.is_finite() && dilation >= 0.0, || {
        format!("tan_dilation() is {dilation}, expected a finite number, 0 or more")
    })?;
    if let Some(Softening { opening, sliding }) = law.softening() {
        expect(opening >= 0.0 && sliding >= 0.0, || {
            format!("softening() is {opening} m and {sliding} J/m², expected 0 or more")
        })?;
    }
    let pressures = (0..=DECADES).map(|power| -libm::pow(10.0, f64::from(power)));
    for normal in [0.0].into_iter().chain(pressures) {
        bonded(law, normal)?;
        failed(law, normal)?;
        contact(law, normal)?;
    }
    [0.5 * tension, tension].into_iter().try_for_each(|normal| bonded(law, normal))
}

fn expect(sound: bool, what: impl FnOnce() -> String) -> Result<(), String> {
    if sound { Ok(()) } else { Err(what()) }
}

/// Checks that a bonded point under a normal traction fails above its peak strength, and only
/// there.
fn bonded(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let peak = law.peak(normal);
    expect(peak >= 0.0, || format!("peak({normal}) is {peak}, expected 0 Pa or more"))?;
    // The excess is larger than the rounding that `failure` tolerates for joints without shear
    // strength.
    let beyond = 1.0 + 2.0 * peak + SAME * (normal.abs() + law.tension());
    let fails = law.failure(normal, beyond).is_some();
    let seen = law.any_failure(&[normal], &[beyond * beyond]);
    expect(!peak.is_finite() || (fails && seen), || {
        format!(
            "under {normal} Pa a shear of {beyond} Pa is above peak(), and failure() or any_failure() does not say so"
        )
    })?;
    // Laws that wrap this one use its peak strength only, so the point must not fail below it.
    let below = peak * (1.0 - SAME);
    let fails = law.failure(normal, below).is_some();
    let seen = law.any_failure(&[normal], &[below * below]);
    expect(!peak.is_finite() || !(fails || seen), || {
        format!(
            "under {normal} Pa a shear of {below} Pa is below peak(), and failure() or any_failure() says that it fails"
        )
    })
}

/// Checks the residual strength of a failed point under a normal traction: dilation against the
/// pressure must not take more than friction gives.
fn failed(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let residual = law.residual(normal);
    expect(residual.is_finite() && residual >= 0.0, || {
        format!("residual({normal}) is {residual}, expected a finite number, 0 Pa or more")
    })?;
    let lifts = -normal * law.tan_dilation();
    expect(lifts <= residual * (1.0 + SAME), || {
        format!(
            "residual({normal}) is {residual} Pa, less than the {lifts} Pa that tan_dilation() takes: sliding would make \
             energy"
        )
    })
}

/// Checks the strength of bare faces under a normal traction.
fn contact(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let strength = law.contact_strength(normal);
    expect(strength.is_finite() && strength >= 0.0, || {
        format!("contact_strength({normal}) is {strength}, expected a finite number, 0 Pa or more")
    })?;
    expect(normal < 0.0 || strength == 0.0, || {
        format!(
            "contact_strength({normal}) is {strength}, expected 0 Pa: bare faces have no cohesion"
        )
    })?;
    let Some(tan) = law.tan_contact_friction() else { return Ok(()) };
    expect(tan.is_finite() && tan >= 0.0, || {
        format!("tan_contact_friction() is {tan}, expected a finite number, 0 or more")
    })?;
    expect((strength + normal * tan).abs() <= SAME * (strength - normal * tan), || {
        format!(
            "contact_strength({normal}) is {strength}, and tan_contact_friction() says {}: expected the same",
            -normal * tan
        )
    })
}
