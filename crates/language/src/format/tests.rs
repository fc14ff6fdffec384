//! Tests of the rules of the layout, each with a text before and after.

use expect_test::{Expect, expect};

use super::formatted;

#[track_caller]
fn check(before: &str, after: Expect) {
    let text = formatted(before).expect("it is TOML");
    after.assert_eq(&text);
    assert_eq!(formatted(&text).as_deref(), Ok(&*text), "formatted again");
}

#[test]
fn spaces_around_keys_values_and_brackets_are_normalized() {
    check(
        "  [ ladder ]  \nname=\"a\"  \ndoc   =\t'b'\n[[ program . rung ]]\n\
         when=[ \"X0\",\"X1\" ,]\ndo=[]\n",
        expect![[r#"
            [ladder]
            name = "a"
            doc  = 'b'

            [[program.rung]]
            when = ["X0", "X1"]
            do   = []
        "#]],
    );
    check(
        "[tags]\na={at=\"X0\",doc=\"{,  }\"}\nb={}\n\"c d\" . e=1_000\n",
        expect![[r#"
        [tags]
        a       = { at = "X0", doc = "{,  }" }
        b       = {}
        "c d".e = 1_000
    "#]],
    );
}

#[test]
fn the_values_of_adjacent_keys_are_aligned() {
    check(
        "[tags]\na = { at = \"X0\" }\n# above\nlong = { at = \"X1\" }\n\n\
         # A group\nlonger = { at = \"X2\" }\n",
        expect![[r#"
            [tags]
            a    = { at = "X0" }
            # above
            long = { at = "X1" }

            # A group
            longer = { at = "X2" }
        "#]],
    );
    // Keys above the first header are not aligned, and neither is a list of tables.
    check(
        "ladder = []\nalways = [\"X0\"]\nset = 1\n",
        expect![[r#"
        ladder = []
        always = ["X0"]
        set = 1
    "#]],
    );
    check(
        "[[device]]\nname = \"a\"\nmap  = [{from=\"X0\",to=\"a\"}]\n",
        expect![[r#"
        [[device]]
        name = "a"
        map = [{ from = "X0", to = "a" }]
    "#]],
    );
}

#[test]
fn blank_lines_are_normalized() {
    check(
        "\n\n# The file\n\n\n[ladder]\n\nname = \"a\"\n[tags]\n# Inputs\n\
         a = { at = \"X0\" }\n\n\n\nb = { at = \"X1\" }\n# Main\n[[program]]\n\
         \n\nname = \"Main\"\n\n",
        expect![[r##"
            # The file

            [ladder]
            name = "a"

            [tags]
            # Inputs
            a = { at = "X0" }

            b = { at = "X1" }

            # Main
            [[program]]
            name = "Main"
        "##]],
    );
    // The keys of a rung are one group, and its branches follow without a blank line.
    check(
        "[[program.rung]]\nwhen = [\"X0\"]\n\ndo = []\n\n\
         [[program.rung.branch]]\nwhen = []\n# Why\n[[program.rung.branch]]\n\
         do = []\n[[program.rung]]\n[program.rung.with]\na = 1\n",
        expect![[r#"
            [[program.rung]]
            when = ["X0"]
            do   = []
            [[program.rung.branch]]
            when = []

            # Why
            [[program.rung.branch]]
            do = []

            [[program.rung]]
            [program.rung.with]
            a = 1
        "#]],
    );
}

#[test]
fn the_keys_of_a_ladder_are_sorted() {
    check(
        "[[program.rung]]\ndo = [\"OUT Y0\"]\nleg.rst = [\"X1\"]\n\
         leg.up = [\"X0\"]\ndoc = \"b\"\n# of the name\n\
         name = \"a\" # its end\n",
        expect![[r#"
            [[program.rung]]
            # of the name
            name    = "a"  # its end
            doc     = "b"
            leg.up  = ["X0"]
            leg.rst = ["X1"]
            do      = ["OUT Y0"]
        "#]],
    );
    check(
        "[tags]\n\
         b = { log = \"change\", doc = \"b\", max = 3, min = 1, at = \"D0\" }\n\
         a = { doc = \"a\", at = \"X0\" }\n",
        expect![[r#"
            [tags]
            b = { at = "D0", min = 1, max = 3, doc = "b", log = "change" }
            a = { at = "X0", doc = "a" }
        "#]],
    );
    check(
        "[[program]]\n\
         rung = [{ do = [\"OUT Y0\"], when = [\"X0\"] }, { name = \"u\", use = \"U\" }]\n\
         doc = \"d\"\nname = \"Main\"\n",
        expect![[r#"
            [[program]]
            name = "Main"
            doc  = "d"
            rung = [{ when = ["X0"], do = ["OUT Y0"] }, { use = "U", name = "u" }]
        "#]],
    );
    // Other tables keep their order.
    check(
        "[scan]\nwatchdog = \"1s\"\nperiod = \"1ms\"\n",
        expect![[r#"
        [scan]
        watchdog = "1s"
        period   = "1ms"
    "#]],
    );
}

#[test]
fn a_key_is_not_moved_across_a_blank_line_or_a_related_comment() {
    check(
        "[[task]]\ndoc = \"d\"\n\n# Alone\n\nname = \"N\"\n",
        expect![[r#"
        [[task]]
        doc = "d"

        # Alone

        name = "N"
    "#]],
    );
    check(
        "[[task]]\ndoc = \"d\"\nname = \"N\"\n# About the name, or what follows\n",
        expect![[r#"
            [[task]]
            doc  = "d"
            name = "N"
            # About the name, or what follows
        "#]],
    );
    check(
        "[[task]]\ndoc = \"d\"\nname = \"N\"\n# Of the rung\n[[task.rung]]\n",
        expect![[r#"
        [[task]]
        name = "N"
        doc  = "d"

        # Of the rung
        [[task.rung]]
    "#]],
    );
}

#[test]
fn arrays_keep_their_line_breaks_where_they_fit() {
    check(
        "[[x]]\na = [\n  1, 2,\n\n\n  3 ]\nb = [1,\n[2,3]]\nc = [\n]\n",
        expect![[r#"
        [[x]]
        a = [
            1,
            2,

            3,
        ]
        b = [
            1,
            [2, 3],
        ]
        c = []
    "#]],
    );
    let texts = |chars| format!("[x]\nwhen = [\"{}\", \"b\"]\n", "a".repeat(chars));
    let broken = format!("[x]\nwhen = [\n    \"{}\",\n    \"b\",\n]\n", "a".repeat(85));
    assert_eq!(formatted(&texts(85)).as_deref(), Ok(&*broken));
    assert_eq!(formatted(&texts(84)).as_deref(), Ok(&*texts(84)));
    // An inline table stays on its line.
    check(
        "rung = [{ when = [\n\"X0\",\n\"X1\"\n], do = [] }]\n",
        expect![[r#"
        rung = [{ when = ["X0", "X1"], do = [] }]
    "#]],
    );
}

#[test]
fn comments_in_arrays_stay_beside_their_elements() {
    check(
        "a = [ # first\n  # of one\n  1 # one\n  , 2, # two\n  # last\n]\n\
         b = [1, # one\n2]\nc = [{ d = [ # deep\n1] }]\n",
        expect![[r#"
            a = [        # first
                # of one
                1,       # one
                2,       # two
                # last
            ]
            b = [
                1,       # one
                2,
            ]
            c = [
                { d = [  # deep
                    1,
                ] },
            ]
        "#]],
    );
}

#[test]
fn the_rows_of_a_device_map_are_aligned() {
    check(
        "[[device]]\nmap = [\n{ from = \"a\", to = \"X0\", type = \"bit\" },\n\
         # more\n{ from=\"longer\", to=\"X10\", type=\"bit\" },\n]\n",
        expect![[r#"
            [[device]]
            map = [
                { from = "a",      to = "X0",  type = "bit" },
                # more
                { from = "longer", to = "X10", type = "bit" },
            ]
        "#]],
    );
    check(
        "map = [\n{ from = \"a\", to = \"X0\" },\n{ from = \"longer\" },\n]\n",
        expect![[r#"
        map = [
            { from = "a", to = "X0" },
            { from = "longer" },
        ]
    "#]],
    );
}

#[test]
fn comments_at_the_ends_of_lines_are_aligned() {
    check(
        "[scan]     # a\nperiod=\"10ms\"  # b\nwatchdog = \"1s\"     # c\n",
        expect![[r#"
        [scan]             # a
        period   = "10ms"  # b
        watchdog = "1s"    # c
    "#]],
    );
    // If the column has no room, the comments move together. A very long line moves alone.
    check(
        "[scan] # a\nperiod = \"10ms\" #b  \n\n[x] # c\n",
        expect![[r#"
        [scan]           # a
        period = "10ms"  #b

        [x]  # c
    "#]],
    );
    let long = format!("[x]   # a\nkey = \"{}\" # b\n", "x".repeat(70));
    check(
        &long,
        expect![[r#"
        [x]   # a
        key = "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"  # b
    "#]],
    );
}

#[test]
fn strings_and_numbers_are_not_changed() {
    check(
        "[x]\na = \"\"\"\n  one  \n\n\n  two = [1,2] # no comment\n\"\"\" # b\n\
         b='''c\n'''\nc=0xFF\nd=1e3\ne = 2026-11-22 06:00:00\nf = -0.0\n",
        expect![[r#"
            [x]
            a = """
              one  


              two = [1,2] # no comment
            """  # b
            b = '''c
            '''
            c = 0xFF
            d = 1e3
            e = 2026-11-22 06:00:00
            f = -0.0
        "#]],
    );
}

#[test]
fn line_endings_and_the_byte_order_mark_are_kept() {
    let unix = "[x]\na=[1,\n2] # b  \n\n\n[y]";
    let text = formatted(&unix.replace('\n', "\r\n")).expect("it is TOML");
    assert_eq!(text, formatted(unix).expect("it is TOML").replace('\n', "\r\n"));
    assert_eq!(formatted("").as_deref(), Ok(""));
    assert_eq!(formatted("\n\n").as_deref(), Ok(""));
    assert_eq!(formatted("\u{feff}a=1").as_deref(), Ok("\u{feff}a = 1\n"));
    let commented = formatted("\u{feff}[tags]# c").expect("it is TOML");
    assert_eq!(formatted(&commented).as_deref(), Ok(commented.as_str()), "the mark has no width");
}

#[test]
fn a_text_that_is_not_toml_is_refused_with_its_findings() {
    for text in ["a = \n", "[x\n", "a = 1\na = 2\n", "a = { b = 1, }\n", "a = { b = 1,\n c = 2 }\n"]
    {
        let findings = formatted(text).expect_err(text);
        assert_eq!(findings.len(), 1, "{text}");
    }
    // A misplaced header is valid TOML: `rungd check` reports it.
    let text = "[[program.rung]]\nwhen = []\n\n[[task]]\n\n[[program.stage]]\n";
    assert_eq!(formatted(text).as_deref(), Ok(text));
}

/// One long key or line does not lengthen the other lines.
#[test]
fn one_long_line_does_not_lengthen_the_other_lines() {
    let (long, count) = ("k".repeat(20_000), 2_000);
    let keys: String = (0..count).map(|n| format!("k{n} = 1 # c\n")).collect();
    let rows: String = (0..count).map(|n| format!("{{ from = {n}, to = 1 }},\n")).collect();
    for text in [
        format!("[x]\n{long} = 1\n{keys}"),
        format!("[x]\nkey = \"{long}\" # c\n{keys}"),
        format!("[x]{}# c\n{keys}", " ".repeat(20_000)),
        format!("[x]\nmap = [{{ from = \"{long}\", to = 1 }},\n{rows}]\n"),
        format!("[x]\n{}1{} = 1\n{keys}", "1 . ".repeat(60), " ".repeat(20_000)),
    ] {
        let after = formatted(&text).expect("it is TOML");
        assert!(after.len() < 300_000, "{} from {}", after.len(), text.len());
        assert_eq!(formatted(&after).as_deref(), Ok(&*after), "formatted again");
    }
}

#[test]
fn a_header_above_its_parent_is_refused_if_the_text_is_not_toml() {
    for text in ["[[program.rung]]\n[[program]]\n", "[template.tags]\n[[template]]\n"] {
        let findings = formatted(text).expect_err(text);
        assert_eq!(findings[0].code.name(), "out-of-place", "{text}");
    }
}
