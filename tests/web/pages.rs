//! A viewer's pages: the ladder with the power of a scan, why, trends, panels.

use std::time::SystemTime;

use serde_json::json;

use crate::web::client::Web;

const WINDOW: &str = "/events?element=Main&from=1&to=2&tags=level,lamp,parts.Acc";

#[test]
fn a_page_shows_live_power_and_live_values() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    for (path, kind) in
        [("/", "text/html"), ("/app.js", "text/javascript"), ("/style.css", "text/css")]
    {
        let page = web.get(path, &visitor);
        assert!(page.status == 200 && page.header("content-type").unwrap().starts_with(kind));
        let policy = page.header("content-security-policy").unwrap();
        assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
    }
    let ladder = web.get("/api/ladder", &visitor).json();
    assert_eq!((&ladder["name"], &ladder["blocks"][0]["rows"]), (&json!("web"), &json!([1, 2])));
    let rungs = web.get("/api/rungs?element=Main&from=1&to=9", &visitor).json();
    let svg = rungs["rungs"][0]["svg"].as_str().unwrap();
    assert_eq!(rungs["rungs"].as_array().unwrap().len(), 2);
    assert_eq!(rungs["rungs"][1]["words"], json!(["parts.Acc"]));
    let seen = web.until(WINDOW, &visitor, |event| event["power"]["1"].is_string());
    // Neither contact conducts, so only the wire before the first one has power.
    assert_eq!(seen["power"]["1"], "01000000");
    assert_eq!(svg.matches("data-p").count(), 8);
    assert_eq!((&seen["values"]["lamp"], &seen["mode"]), (&json!(false), &json!("RUN")));
    assert_eq!(seen["running"], json!(["Main"]));
    web.live.ok("write level 50");
    web.live.ok("write start ON");
    let seen = web.until(WINDOW, &visitor, |event| event["values"]["lamp"] == true);
    assert_eq!((&seen["power"]["1"], &seen["values"]["level"]), (&json!("11111111"), &json!(50)));
    assert_eq!(seen["values"]["parts.Acc"], 1);
    let idle = "/events?element=Side&from=1&to=1";
    let seen = web.until(idle, &visitor, |event| event["power"].get("1").is_some());
    assert_eq!(seen["power"]["1"], json!(null), "Side does not run");
    web.live.ok("mode stop");
    let seen = web.until(WINDOW, &visitor, |event| event["mode"] == "STOP");
    assert_eq!((&seen["power"]["1"], &seen["running"]), (&json!(null), &json!([])));
}

#[test]
fn the_page_can_explain_a_name_and_hold_a_moment_of_the_past() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    web.live.ok("write level 50");
    web.live.ok("write start ON");
    web.until(WINDOW, &visitor, |event| event["values"]["lamp"] == true);
    let why = web.get("/api/why?operand=lamp", &visitor).json();
    let text = why["text"].as_str().unwrap();
    assert!(text.starts_with("lamp (Y0) is ON\n") && text.contains("root (uid "), "{text}");
    assert!(!text.contains("gap"), "what follows follows: {text}");
    let held = web.get("/api/hold", &visitor).json();
    let (hold, last) = (&held["hold"], held["scans"][1].as_u64().unwrap());
    web.live.ok("write start OFF");
    web.until(WINDOW, &visitor, |event| event["values"]["lamp"] == false);
    let scan = |number: u64| {
        let path =
            format!("/api/scan?element=Main&from=1&to=1&tags=lamp&hold={hold}&scan={number}");
        web.get(&path, &visitor)
    };
    assert_eq!(scan(last).json()["values"]["lamp"], true);
    // Goes back scan by scan to the one in which the lamp went ON.
    let mut at = last;
    while scan(at).json()["values"]["lamp"] == true {
        at -= 1;
    }
    let before = web.get(&format!("/api/why?operand=lamp&hold={hold}&scan={at}"), &visitor).json();
    assert!(before["text"].as_str().unwrap().starts_with("lamp (Y0) is OFF"), "{before}");
    assert_eq!(scan(last + 1).status, 410);
    assert_eq!(web.get("/api/scan?scan=1&hold=77", &visitor).status, 410);
}

#[cfg(feature = "prove")]
#[test]
fn the_page_can_ask_how_a_value_could_change() {
    let web = Web::start(&[]);
    let visitor = web.visit();
    assert_eq!(web.get("/api/session", &visitor).json()["how"], true);
    let how = web.get("/api/how?operand=start", &visitor).json();
    let text = how["text"].as_str().unwrap();
    assert!(text.starts_with("write 1 into start; start is ON in the same scan\n"), "{how}");
    assert_eq!(how["answer"]["answer"], "found");
    let refused = web.get("/api/how?operand=nobody", &visitor);
    assert_eq!(refused.status, 400);
    assert!(refused.json()["error"].as_str().unwrap().contains("nobody"), "{refused:?}");
}

#[test]
fn tags_can_be_searched_and_trends_contain_every_change() {
    let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
    let web = Web::start(&[]);
    let visitor = web.visit();
    let found = web.get("/api/tags?find=PEOPLE", &visitor).json();
    assert_eq!(found["tags"][0]["name"], "level");
    assert_eq!(found["tags"][0]["unit"], "cm");
    let found = web.get("/api/tags?find=Le+vel", &visitor).json();
    assert_eq!(found["tags"][0]["name"], "level", "as people say it");
    assert_eq!(
        web.get("/api/tags?find=ct0", &visitor).json()["tags"][0]["members"][0],
        "parts.Acc"
    );
    for value in ["20", "30", "10"] {
        web.live.ok(&format!("write level {value}"));
    }
    web.until(WINDOW, &visitor, |event| event["values"]["level"] == 10);
    let trend = web.get("/api/trend?operand=level", &visitor).json();
    let points = trend["points"].as_array().unwrap();
    let values: Vec<_> = points.iter().map(|point| point[2].as_i64().unwrap()).collect();
    assert_eq!(values, [0, 20, 30, 10]);
    web.live.ok("force lamp ON");
    web.until(WINDOW, &visitor, |event| event["values"]["lamp"] == true);
    let happened = web.get("/api/events", &visitor).json();
    let texts: Vec<_> =
        happened["events"].as_array().unwrap().iter().map(|of| &of["text"]).collect();
    let has = |part: &str| texts.iter().any(|text| text.as_str().unwrap().contains(part));
    assert!(has("forced lamp to ON") && has("wrote 30 to level") && has("RUN"), "{texts:?}");
    // RUN and the first values come before the first scan, and have the time of that scan.
    let run = texts.iter().position(|text| **text == "RUN").expect("it went into RUN");
    for first in [&happened["events"][run]["time_ms"], &trend["span_ms"][0]] {
        assert!(first.as_f64().unwrap() >= began.as_millis() as f64 - 1.0, "{first}");
    }
    let panels = web.get("/api/panels", &visitor).json();
    let show = &panels["panels"][0]["show"];
    assert_eq!(show[3]["limits"], json!([0, 100]));
    assert_eq!((&show[1]["confirm"], &show[1]["takes"]), (&json!("Start the line?"), &json!(null)));
    assert_eq!((&show[2]["unit"], &show[2]["decimals"]), (&json!("cm"), &json!(1)));
    assert_eq!((&show[2]["takes"], &show[2]["real"]), (&json!([0.0, 100.0]), &json!(false)));
    assert_eq!(show[3]["unit"], "m", "its own unit comes before the tag's");
    for (path, says) in [
        ("/api/why?operand=lamb", "lamp"),
        ("/api/why?operand=", "name an operand"),
        ("/api/trend?operand=parts", "structure"),
        ("/api/rungs?element=Nobody", "no block or Stage"),
        ("/api/why?operand=lamp&scan=-1", "`scan` is a whole number"),
        ("/api/scan?scan=1.5", "`scan` is a whole number"),
        ("/api/trend?operand=lamp&hold=x", "`hold` is a whole number"),
        ("/api/rungs?element=Main&from=one", "`from` is a whole number"),
        ("/api/rungs?element=Main&to=", "`to` is a whole number"),
        ("/events?element=Main&from=-1", "`from` is a whole number"),
        ("/api/why?operand=lamp&scn=5", "there is no key `scn`"),
        ("/api/why?operand=lamp&operand=start", "`operand` stands twice"),
    ] {
        let refused = web.get(path, &visitor);
        assert_eq!(refused.status, 400, "{path}");
        assert!(refused.json()["error"].as_str().unwrap().contains(says), "{refused:?}");
    }
    for bound in ["from", "to"] {
        let path = format!("/api/rungs?element=Main&{bound}=18446744073709551615");
        assert_eq!(web.get(&path, &visitor).status, 200, "{path}");
    }
    assert_eq!(web.get("/api/nothing", &visitor).status, 404);
}

/// After a reload the page receives a message, and loads the new program.
#[test]
fn a_page_follows_a_reload_and_a_restart() {
    let mut web = Web::start(&[]);
    let visitor = web.visit();
    let program = |web: &Web| web.get("/api/ladder", &visitor).json()["program"].clone();
    let first = program(&web);
    web.live.ok("write level 7");
    web.until(WINDOW, &visitor, |event| event["scan"].is_u64());
    let why = || web.get("/api/why?operand=level", &visitor).json()["text"].to_string();
    rungd_test_support::running::process::until(|| why().contains("wrote 7"));
    let ladder = crate::web::client::LADDER.replace("level > 10", "level > 20");
    std::fs::write(web.live.folder.join("ladder.toml"), ladder).unwrap();
    web.live.ok("reload");
    let seen = web.until(WINDOW, &visitor, |event| event["program"] != first);
    assert_eq!(seen["program"], program(&web));
    let rungs = web.get("/api/rungs?element=Main&from=1&to=1", &visitor).json();
    assert!(rungs["rungs"][0]["svg"].as_str().unwrap().contains("level &gt; 20"));
    let why = web.get("/api/why?operand=level", &visitor).json()["text"].to_string();
    assert!(why.contains("before the program was reloaded") && why.contains("wrote 7"), "{why}");
    let changes = web.get("/api/deploys", &visitor).json()["deploys"].clone();
    let change = &changes[0];
    assert_eq!((changes.as_array().map(Vec::len), &change["rollback"]), (Some(1), &false.into()));
    assert!(change["who"].as_str().is_some_and(|who| who.contains("uid")), "{change}");
    let report = change["report"].to_string();
    assert!(report.contains("level > 10") && report.contains("level > 20"), "{report}");
    web.live.child.kill().unwrap();
    web.live.child.wait().unwrap();
    let gone = web.until(WINDOW, &visitor, |event| event["error"].is_string());
    assert!(gone["error"].as_str().unwrap().contains("no rungd answers"), "{gone}");
    let folder = web.live.folder.clone();
    web.live.child = rungd_test_support::running::live::run(&folder, &[]).spawn().unwrap();
    let back = web.until(WINDOW, &visitor, |event| {
        event["program"].is_string() && event["program"] != seen["program"]
    });
    assert_eq!(back["mode"], "RUN");
}
