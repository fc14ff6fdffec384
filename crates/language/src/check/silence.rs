//! `allow`: removes the warnings that the author silenced.
//!
//! Called by the loader with all findings. A rung's `allow` silences the warnings whose place
//! begins in the rung. `[ladder] allow` silences the warnings of its file and of the controller
//! file, which has no `allow` of its own. Related places of a warning do not count. Errors are
//! never silenced.

use std::collections::HashSet;

use crate::resolve::program::Program;
use crate::source::finding::{Finding, Severity};
use crate::source::span::{FileId, Span};

/// The findings without the allowed warnings. Warnings of the readers can be allowed too.
/// `controller`: the controller file.
pub fn silence(
    program: &Program,
    findings: Vec<Finding>,
    controller: Option<FileId>,
) -> Vec<Finding> {
    let allows = rung_allows(program);
    let in_files: HashSet<(FileId, &str)> =
        program.allow.iter().map(|(file, name)| (*file, name.as_str())).collect();
    let in_any: HashSet<&str> = program.allow.iter().map(|(_, name)| name.as_str()).collect();
    let silenced = |finding: &Finding| {
        let name = finding.code.name();
        let place = program.layers.place_in_rung(finding.span);
        let in_file = |span| in_files.contains(&(program.layers.in_file(span).file, name));
        let of_controller = Some(place.file) == controller && in_any.contains(name);
        of_controller || in_file(finding.span) || in_file(place) || allows.hold(name, place)
    };
    findings.into_iter().filter(|f| f.severity() == Severity::Error || !silenced(f)).collect()
}

/// The `allow` lists of rungs, in order of place. Rungs do not overlap.
struct Allows<'a>(Vec<(Span, HashSet<&'a str>)>);

fn rung_allows(program: &Program) -> Allows<'_> {
    let rungs = program.parts().flat_map(|part| part.rungs);
    let allowing = rungs.filter(|rung| !rung.allow.is_empty());
    let names = allowing
        .map(|rung| (rung.extent, rung.allow.iter().map(String::as_str).collect::<HashSet<_>>()));
    let mut allows: Vec<_> = names.collect();
    allows.sort_by_key(|(extent, _)| (extent.file, extent.start));
    Allows(allows)
}

impl Allows<'_> {
    /// Whether the rung in which the place begins allows findings of this name.
    fn hold(&self, name: &str, span: Span) -> bool {
        let place = (span.file, span.start);
        let behind = self.0.partition_point(|(extent, _)| (extent.file, extent.start) <= place);
        let rung = behind.checked_sub(1).map(|at| &self.0[at]);
        rung.is_some_and(|(extent, allowed)| {
            extent.file == span.file && span.start < extent.end && allowed.contains(name)
        })
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::check::testing::{check, check_main};

    #[test]
    fn an_allow_of_a_rung_silences_findings_that_begin_in_the_rung() {
        check(
            r#"
            [[program]]
            name = "Main"

            [[program.rung]]
            allow = ["bare-timer-value"]
            when = ["T0.Acc > 5"]
            do = ["TMR T0 preset=5"]

            [[program.rung.branch]]
            when = ["X0"]
            do = ["TMR T1 preset=5", "SET C0"]

            [[program.rung]]
            when = ["X0"]
            do = ["TMR T2 preset=5"]
            "#,
            expect![[r#"
                11:31 set-never-reset
                  `C0` is SET, and nothing ever turns it OFF
                    `RST C0` in a rung with its condition, or `OUT C0` if the bit is to
                    follow this rung
                15:22 bare-timer-value
                  `preset=5` of `TMR` has no unit: ms or s?
                    `preset=5ms`, as it is read now, or `preset=5s`
            "#]],
        );
    }

    #[test]
    fn an_allow_of_a_one_line_rung_silences_only_that_rung() {
        check_main(
            r#"
            { allow = ["bare-timer-value"], when = ["X0"], do = ["TMR T0 preset=5"] },
            { when = ["X0"], do = ["TMR T1 preset=5"] },
            { when = ["X0"], do = ["TMR T2 preset=5"], allow = ["bare-timer-value"] },
            "#,
            expect![[r#"
                5:39 bare-timer-value
                  `preset=5` of `TMR` has no unit: ms or s?
                    `preset=5ms`, as it is read now, or `preset=5s`
            "#]],
        );
    }

    #[test]
    fn an_allow_of_a_ladder_silences_warnings_of_its_file_but_not_errors() {
        check(
            r#"
            [ladder]
            allow = ["bare-timer-value", "duplicate-out"]

            [[program]]
            name = "Main"
            rung = [
              { when = ["X0"], do = ["TMR T2 preset=5", "OUT Y0"] },
              { when = ["X1"], do = ["OUT Y0"] },
            ]
            "#,
            expect![[r#"
                2:31 unknown-allow
                  `duplicate-out` is an error: it cannot be silenced
                8:29 duplicate-out
                  `Y0` is driven twice, by `OUT` in program `Main`, rung 1, and by `OUT`
                  in program `Main`, rung 2: the last one decides
                    drive it in one rung, if either condition is to turn it ON:
                    when = ["X0 | X1"]
                    do = ["OUT Y0"]
            "#]],
        );
    }
}
