//! Unit tests of mimics: what of a drawing reaches a page.

use super::*;

fn svg(inner: &str) -> String {
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\">{inner}</svg>")
}

fn safe(inner: &str) -> String {
    made_safe(&svg(inner)).unwrap_or_else(|why| panic!("{inner}: {why}")).svg
}

fn refused(text: &str) -> String {
    made_safe(text).expect_err(text).to_string()
}

#[test]
fn shapes_texts_and_bindings_stay_as_they_are() {
    let inner = "<g id=\"a\" data-tag=\"p\" data-on=\"#0a0\"><path d=\"M0 0 L9 Z\" fill=\"none\"/>\
                 <text x=\"1\" data-text=\"level\">Tank &amp; pump</text></g>";
    let wanted = inner.replace("id=\"a\"", "id=\"mimic-a\"");
    assert_eq!(safe(inner), svg(&wanted));
    assert_eq!(made_safe(&svg(inner)).unwrap().left_out, Vec::<String>::new());
}

#[test]
fn a_style_becomes_attributes_and_a_reference_stays_within_the_file() {
    let inner = "<rect style=\"fill:url(#g);stroke : red;behavior:url(x)\" stroke=\"blue\"/>";
    assert_eq!(safe(inner), svg("<rect fill=\"url(#mimic-g)\" stroke=\"red\"/>"));
    for outside in ["url(http://a/b#c)", "url(//a)", "url( 'data:x' )", "URL(#x)", "url(#a)url(b)"]
    {
        assert_eq!(safe(&format!("<rect fill=\"{outside}\"/>")), svg("<rect/>"), "{outside}");
    }
}

#[test]
fn an_end_of_a_line_of_windows_is_an_end_of_a_line() {
    assert_eq!(safe("<path d=\"M0 0\r\nL1\t1\"/>\r\n"), svg("<path d=\"M0 0\nL1\t1\"/>\n"));
}

#[test]
fn a_layer_that_is_hidden_stays_hidden() {
    for (inner, hidden) in [
        ("<g style=\"display:none\"><text>a</text></g>", "<g display=\"none\">"),
        ("<g display=\"none\"><text>a</text></g>", "<g display=\"none\">"),
        ("<g style=\"visibility : hidden\"/>", "<g visibility=\"hidden\"/>"),
    ] {
        assert!(safe(inner).contains(hidden), "{inner}");
        assert_eq!(made_safe(&svg(inner)).unwrap().left_out, Vec::<String>::new(), "{inner}");
    }
}

#[test]
fn a_style_wins_over_attributes_before_and_behind_it_and_its_last_declaration_wins() {
    for (inner, wanted) in [
        ("<rect fill=\"blue\" style=\"fill:red\"/>", "<rect fill=\"red\"/>"),
        ("<rect style=\"fill:red\" fill=\"blue\"/>", "<rect fill=\"red\"/>"),
        ("<rect style=\"fill:blue; fill:red;\"/>", "<rect fill=\"red\"/>"),
    ] {
        assert_eq!(safe(inner), svg(wanted), "{inner}");
    }
}

#[test]
fn what_is_left_out_of_a_style_is_told() {
    let inner =
        "<rect style=\"filter:blur(2px);fill:url(http://a);bad;-inkscape-x:1;stroke:red;\"/>";
    let mimic = made_safe(&svg(inner)).unwrap();
    assert_eq!(mimic.svg, svg("<rect stroke=\"red\"/>"));
    // As names of other programs in attributes, a key of another program is not told.
    assert_eq!(mimic.left_out, ["bad", "fill", "filter"]);
}

#[test]
fn nothing_that_executes_loads_or_copies_is_left() {
    for inner in [
        "<script>alert(1)</script>",
        "<g><script xlink:href=\"http://a/b.js\"/></g>",
        "<a href=\"javascript:alert(1)\"><text>x</text></a>",
        "<rect onclick=\"alert(1)\" onload='alert(2)'/>",
        "<image href=\"http://a/b.png\"/><use href=\"#a\"/><style>@import 'http://a'</style>",
        "<foreignObject><iframe src=\"http://a\"/></foreignObject>",
        "<animate attributeName=\"href\" to=\"javascript:alert(1)\"/><set/>",
        "<svg onload=\"alert(1)\"><svg/></svg>",
        "<rect fill=\"&#x75;rl(http://a)\" d=\"&lt;script&gt;\"/>",
        "<text>&lt;script&gt;alert(1)&lt;/script&gt;<![CDATA[<script>]]></text>",
        "<SCRIPT>alert(1)</SCRIPT><svg:script>alert(1)</svg:script>",
        "<g data-tag=\"&quot;&gt;&lt;script&gt;\"/>",
    ] {
        let safe = safe(inner);
        for word in [
            "<script",
            "javascript",
            "http://a",
            "onclick",
            "onload",
            "href",
            "@import",
            "<a",
            "iframe",
        ] {
            assert!(!safe.contains(word), "{inner}: {safe}");
        }
    }
    let left_out = made_safe(&svg("<script/><rect onclick=\"x\"/>")).unwrap().left_out;
    assert_eq!(left_out, ["onclick", "script"]);
}

#[test]
fn what_is_no_svg_is_refused_with_its_line() {
    for (text, words) in [
        ("", "it is no SVG"),
        ("hello", "it is no SVG"),
        ("<html></html>", "it is no SVG"),
        ("<svg>\n<g></svg>", "line 2: `</svg>` ends nothing"),
        ("<svg>", "an element has no end"),
        ("<svg><g", "is written as"),
        ("<svg a></svg>", "is written as"),
        ("<svg a=\"></svg>", "a value has no end"),
        ("<svg>&lol;</svg>", "`&lol;` is no entity"),
        ("<svg>&</svg>", "begins no entity"),
        ("<!DOCTYPE svg [<!ENTITY lol \"lol\">]><svg/>", "declares entities"),
        ("<svg><!-- </svg>", "`-->` is missing"),
        ("<svg/><svg><g/>", "an element has no end"),
    ] {
        let why = refused(text);
        assert!(why.contains(words), "{text}: {why}");
    }
}

#[test]
fn a_huge_or_deep_drawing_is_refused_and_takes_no_longer_for_it() {
    let many = |text: &str, count: usize| text.repeat(count);
    assert!(refused(&svg(&many("<g/>", ELEMENTS_MAX + 1))).contains("more than"));
    assert!(refused(&many("<g>", 100_000)).contains("more than"));
    assert!(refused(&svg(&many("<a>", 100_000))).contains("more than"));
    assert!(refused(&many(" ", BYTES_MAX + 1)).contains("more than"));
    assert!(refused(&format!("<svg {}/>", many("x='1' ", 100))).contains("more than 64"));
    // A giant path is a path.
    let path = format!("<path d=\"M0 0 {}\"/>", many("L1e9 1e9 ", 50_000));
    assert_eq!(safe(&path), svg(&path));
}

#[test]
fn only_a_name_of_a_file_is_read_from_the_folder() {
    let folder = Path::new("/");
    for name in ["../etc/passwd", "/etc/passwd", "a/b.svg", ".svg", "..svg/", "x.png", "", "\0.svg"]
    {
        assert!(read(folder, name).unwrap_err().contains("is no name of a file"), "{name}");
    }
    assert!(read(folder, "nobody-has-this.svg").is_err());
}
