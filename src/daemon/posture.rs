//! Logs the real-time posture: its requests and grants. Applies `strict`.

use crate::runtime::Grant;
use crate::say::say;

/// Logs the grants; `Err` is the reason why the controller does not start.
pub(super) fn tell(grants: &[Grant], strict: bool) -> Result<(), String> {
    let list = |all: &mut dyn Iterator<Item = &Grant>| {
        all.map(|grant| grant.what.as_str()).collect::<Vec<_>>().join(", ")
    };
    let asked = list(&mut grants.iter());
    let granted = list(&mut grants.iter().filter(|grant| grant.refused.is_none()));
    say!(POSTURE, asked, granted, "real-time posture");
    let mut refused = Vec::new();
    for Grant { what, refused: refusal } in grants {
        let Some(refusal) = refusal else { continue };
        let (why, remedy) = (&refusal.why, &refusal.remedy);
        say!(
            POSTURE_REFUSED,
            what = %what,
            why = %why,
            "real-time posture: {what} was refused: {why}; it needs {remedy}"
        );
        refused.push(format!("{what} ({why}; it needs {remedy})"));
    }
    if strict && !refused.is_empty() {
        return Err(format!(
            "`[realtime]` is strict, and not all of it was granted: {}. Grant it (docs/running.md, \
             real-time posture), or take `strict` out",
            refused.join(", ")
        ));
    }
    Ok(())
}
