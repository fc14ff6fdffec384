//! Users by name and number, as `/etc/passwd` lists them.
//!
//! Used by `peer`. This module requests nothing from a name service: a controller
//! starts without a network.

use crate::daemon::narration::one_line;

/// The name of a user in the text of `/etc/passwd`.
pub(super) fn name_of(passwd: &str, uid: u32) -> Option<String> {
    let user = passwd.lines().find(|line| line.split(':').nth(2) == Some(&uid.to_string()))?;
    let name = user.split(':').next()?;
    (!name.is_empty()).then(|| one_line(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_number_is_resolved_to_its_name() {
        let passwd = "root:x:0:0:root:/root:/bin/sh\nanna:x:1000:1000::/home/anna:/bin/sh\n";
        assert_eq!(name_of(passwd, 1000).as_deref(), Some("anna"));
        assert_eq!((name_of(passwd, 7), name_of("", 0)), (None, None));
    }
}
