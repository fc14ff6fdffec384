//! What a page gets of compares and of bits of words: the values of both sides, as the rung read
//! them.

use serde_json::{Value, json};

use crate::web::client::Web;
use rungd_test_support::running::live::Live;

const LADDER: &str = r#"
ladder.name = "tank"
[tags]
level = { at = "D0", log = "change" }
least = { at = "R0", initial = 12.5 }
status = { at = "D1", log = "change" }
settle = { at = "T0" }
lamp = { at = "Y0" }
[[program]]
name = "Main"
[[program.rung]]
when = ["level * 2 + 1 >= least | !(level == 7)", "status.3", "settle.Acc < 3s"]
do   = ["OUT lamp", "MOVE 9 to=level"]
[[program.rung]]
when = ["$Off"]
do   = ["TMR settle preset=5s", "CALL Drain"]
[[subroutine]]
name = "Drain"
rung = [{ when = ["level - 1 > 3"], do = ["OUT C0"] }]
"#;
const WINDOW: &str = "/events?element=Main&from=1&to=2&tags=status.3,status,level";

#[test]
fn a_page_gets_the_values_of_both_sides_of_a_compare_as_its_rung_read_them() {
    let web = Web::of(Live::start(LADDER, "", &[]), &[]);
    let visitor = web.visit();
    let seen = web.until(WINDOW, &visitor, |event| event["compared"]["1"]["0.0"].is_string());
    let sides = json!({ "0.0": "1 >= 12.5", "0.1": "0 == 7", "0.3": "0ms < 3s" });
    assert_eq!(seen["compared"], json!({ "1": sides, "2": {} }));
    let rungs = web.get("/api/rungs?element=Main&from=1&to=1", &visitor).json();
    assert_eq!(rungs["rungs"][0]["words"], json!(["level", "least", "status.3", "settle.Acc"]));
    // In the first scan with 6 the compare reads 6, and the MOVE behind it writes 9.
    web.live.ok("write status 8");
    web.live.ok("write level 6");
    let both = |event: &Value| event["compared"]["1"]["0.0"] == "19 >= 12.5";
    let seen = web.until(WINDOW, &visitor, both);
    assert_eq!(seen["values"], json!({ "status.3": true, "status": 8, "level": 9 }));
    let idle = "/events?element=Drain&from=1&to=1";
    let seen = web.until(idle, &visitor, |event| event["power"].get("1").is_some());
    assert_eq!(seen["compared"]["1"], json!({}), "nothing called it");
    assert_eq!(seen["running"], json!(["Main"]), "a subroutine never runs");
    web.live.ok("mode stop");
    let seen = web.until(WINDOW, &visitor, |event| event["mode"] == "STOP");
    assert_eq!(seen["compared"]["1"], json!({}), "no rung is executed in STOP");
}
