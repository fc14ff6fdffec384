//! Mimics: a drawing of the owner, which reaches a page only as what the server has made of it.

use crate::web::client::Web;
use rungd_test_support::running::live::Live;

const LADDER: &str = "ladder.name = \"tank\"\n[tags]\npump = { at = \"C0\" }\n[[program]]\nname = \
                      \"Main\"\nrung = [{ when = [\"pump\"], do = [\"OUT Y0\"] }]\n";
const CONTROLLER: &str = "[[panel]]\nname = \"Tank\"\nshow = [{ mimic = \"line.svg\" }]\n";
const DRAWING: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" onload="alert(1)">
<script>alert(1)</script><rect data-tag="pump"/><rect data-tag="nobody"/></svg>"#;

#[test]
fn a_drawing_of_a_panel_is_served_safe_and_no_other_file() {
    let live = Live::start(LADDER, CONTROLLER, &[]);
    let folder = live.folder.join("mimics");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("line.svg"), DRAWING).unwrap();
    std::fs::write(folder.join("other.svg"), DRAWING).unwrap();
    let web = Web::of(live, &["--mimics", folder.to_str().unwrap()]);
    let visitor = web.visit();
    let got = web.get("/api/mimic?operand=line.svg", &visitor).json();
    let svg = got["svg"].as_str().unwrap();
    assert!(svg.contains("data-tag=\"pump\"") && !svg.contains("alert"), "{got}");
    assert_eq!(got["left_out"], serde_json::json!(["onload", "script"]));
    assert_eq!(got["unknown"], serde_json::json!(["nobody"]));
    for other in ["other.svg", "../controller.toml", "", "line.svg%00"] {
        assert_eq!(
            web.get(&format!("/api/mimic?operand={other}"), &visitor).status,
            400,
            "{other}"
        );
    }
    // A file that is changed is read again; one that is no drawing is refused with its line.
    std::fs::write(folder.join("line.svg"), "<svg>\n<g></svg>").unwrap();
    let refused = web.get("/api/mimic?operand=line.svg", &visitor);
    assert!(refused.status == 400 && refused.body.contains("line 2"), "{refused:?}");
    std::fs::remove_file(folder.join("line.svg")).unwrap();
    assert_eq!(web.get("/api/mimic?operand=line.svg", &visitor).status, 400);
}

#[test]
fn without_a_folder_a_drawing_says_which_option_is_missing() {
    let web = Web::of(Live::start(LADDER, CONTROLLER, &[]), &[]);
    let refused = web.get("/api/mimic?operand=line.svg", &web.visit());
    assert!(refused.status == 400 && refused.body.contains("--mimics"), "{refused:?}");
}
