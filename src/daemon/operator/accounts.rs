//! Users and groups by name and number, as `/etc/passwd` and `/etc/group` list them.
//!
//! Used by `peer` and `socket`. This module requests nothing from a name service: a controller
//! starts without a network.

use crate::daemon::narration::one_line;

/// The name of a user in the text of `/etc/passwd`.
pub(super) fn name_of(passwd: &str, uid: u32) -> Option<String> {
    let user = passwd.lines().find(|line| line.split(':').nth(2) == Some(&uid.to_string()))?;
    let name = user.split(':').next()?;
    (!name.is_empty()).then(|| one_line(name))
}

/// The number of a group in the text of `/etc/group`.
pub(super) fn gid_of(group: &str, name: &str) -> Option<u32> {
    let row = group.lines().find(|line| line.split(':').next() == Some(name))?;
    row.split(':').nth(2)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_numbers() {
        let passwd = "root:x:0:0:root:/root:/bin/sh\nanna:x:1000:1000::/home/anna:/bin/sh\n";
        assert_eq!(name_of(passwd, 1000).as_deref(), Some("anna"));
        assert_eq!((name_of(passwd, 7), name_of("", 0)), (None, None));
        let group = "root:x:0:\nplant:x:990:anna,ben\nbroken:x\n";
        assert_eq!((gid_of(group, "plant"), gid_of(group, "anna")), (Some(990), None));
        assert_eq!(gid_of(group, "broken"), None);
    }
}
