//! Laws that a program brings: refused where a joint would never fail, or make energy, silently.

use super::{JointLaw, Softening};

/// Powers of ten up to the largest pressure at which a law is tried `[Pa]`.
const DECADES: i32 = 10;
/// Part by which two numbers differ that are to be the same.
const SAME: f64 = 1e-6;

/// Refuses a law a number of which is none that springs can have.
///
/// Springs account for what they take and give whatever the strengths are, as long as these are numbers, not
/// negative, and bear at least what dilation lifts.
pub fn check(law: &dyn JointLaw) -> Result<(), String> {
    let tension = law.tension();
    expect(tension.is_finite() && tension >= 0.0, || {
        format!("tension() is {tension}, expected 0 or more")
    })?;
    let dilation = law.tan_dilation();
    expect(dilation.is_finite() && dilation >= 0.0, || {
        format!("tan_dilation() is {dilation}, expected 0 or more")
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

/// A bonded point under a normal traction fails where its strength says so.
fn bonded(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let peak = law.peak(normal);
    expect(peak >= 0.0, || format!("peak({normal}) is {peak}, expected 0 Pa or more"))?;
    // Beyond rounding, too, which laws leave to joints without shear strength.
    let beyond = 1.0 + 2.0 * peak + SAME * (normal.abs() + law.tension());
    let fails = law.failure(normal, beyond).is_some();
    let seen = law.any_failure(&[normal], &[beyond * beyond]);
    expect(!peak.is_finite() || (fails && seen), || {
        format!(
            "under {normal} Pa a shear of {beyond} Pa is above peak(), and failure() or any_failure() does not say so"
        )
    })
}

/// A failed point under a normal traction: dilation against the pressure takes no more than friction gives.
fn failed(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let residual = law.residual(normal);
    expect(residual.is_finite() && residual >= 0.0, || {
        format!("residual({normal}) is {residual}, expected 0 Pa or more")
    })?;
    let lifts = -normal * law.tan_dilation();
    expect(lifts <= residual * (1.0 + SAME), || {
        format!(
            "residual({normal}) is {residual} Pa, less than the {lifts} Pa that tan_dilation() takes: sliding would make \
             energy"
        )
    })
}

/// Bare faces under a normal traction.
fn contact(law: &dyn JointLaw, normal: f64) -> Result<(), String> {
    let strength = law.contact_strength(normal);
    expect(strength.is_finite() && strength >= 0.0, || {
        format!("contact_strength({normal}) is {strength}, expected 0 Pa or more")
    })?;
    expect(normal < 0.0 || strength == 0.0, || {
        format!(
            "contact_strength({normal}) is {strength}, expected 0 Pa: bare faces have no cohesion"
        )
    })?;
    let Some(tan) = law.tan_contact_friction() else { return Ok(()) };
    expect(tan.is_finite() && tan >= 0.0, || {
        format!("tan_contact_friction() is {tan}, expected 0 or more")
    })?;
    expect((strength + normal * tan).abs() <= SAME * (strength - normal * tan), || {
        format!(
            "contact_strength({normal}) is {strength}, and tan_contact_friction() says {}: expected the same",
            -normal * tan
        )
    })
}
