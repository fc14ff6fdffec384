//! Recipes: a record array as a table, whose changes are one change.

use serde_json::{Value, json};

use super::users::signed_in;
use crate::web::client::{Visitor, Web};

const LADDER: &str = r#"
ladder.name = "bakery"
[[record]]
name = "Recipe"
fields = { sugar = { type = "int", min = 0, max = 500, unit = "g" }, hot = { type = "bit" } }
[tags]
recipes = { type = "Recipe", count = 3, initial = [{ sugar = 100 }, { sugar = 200, hot = true }] }
secret = { at = "D0" }
lamp = { at = "Y0" }
[[program]]
name = "Main"
rung = [{ when = ["recipes[0].hot", "recipes[0].sugar > secret"], do = ["OUT lamp"] }]
"#;
const CONTROLLER: &str = r#"
[web]
write = ["recipes"]
[[panel]]
name = "Bakery"
show = [{ recipe = "recipes", text = "Cakes" }, { lamp = "lamp" }]
"#;

fn bakery() -> (Web, Visitor) {
    signed_in(LADDER, CONTROLLER)
}

fn value(web: &Web, operand: &str) -> Value {
    web.live.say(&format!("read --json {operand}")).json()["values"][0]["value"].clone()
}

#[test]
fn the_values_of_a_recipe_and_its_file_are_of_one_scan() {
    let (web, anna) = bakery();
    let panels = web.get("/api/panels", &anna).json();
    assert_eq!(panels["panels"][0]["show"][0]["write"], true);
    assert_eq!(panels["panels"][0]["show"][1]["write"], json!(null));
    let recipe = web.get("/api/recipe?operand=recipes", &anna).json();
    let values = recipe["values"].as_array().unwrap();
    assert_eq!(values.len(), 6);
    let sugar = values.iter().find(|of| of["operand"] == "recipes[1].sugar").unwrap();
    assert_eq!((&sugar["value"], &sugar["unit"]), (&json!(200), &json!("g")));
    assert_eq!(sugar["takes"], json!([0.0, 500.0]));
    let file = recipe["file"].as_str().unwrap();
    assert!(file.starts_with("recipes = [\n"), "{file}");
    // The file is one of `rungd write --file`, and the page reads it back.
    let path = web.live.folder.join("set.toml");
    std::fs::write(&path, file).unwrap();
    web.live.ok(&format!("write --file {}", path.display()));
    let read = web.post("/api/recipe/read", &anna, &json!({ "operand": "recipes", "file": file }));
    assert_eq!(read.json()["writes"].as_array().unwrap().len(), 6, "{read:?}");
    for operand in ["lamp", "secret", "", "recipes[0]"] {
        assert_eq!(web.get(&format!("/api/recipe?operand={operand}"), &anna).status, 400);
    }
}

#[test]
fn a_recipe_is_written_as_one_change_or_not_at_all() {
    let (web, anna) = bakery();
    let write = |writes: Value| {
        web.post("/api/recipe", &anna, &json!({ "operand": "recipes", "writes": writes }))
    };
    let one = |operand: &str, value: Value| json!({ "operand": operand, "value": value });
    let both = json!([one("recipes[0].sugar", json!("150")), one("recipes[2].hot", json!(true))]);
    let done = write(both);
    assert_eq!((done.status, done.json()["changes"].as_array().unwrap().len()), (200, 2));
    let line = web.live.line("wrote in one change 150 to recipes[0].sugar");
    assert!(line["who"].as_str().unwrap().starts_with("anna by "), "{line}");
    // One wrong value refuses all of them, and each has its reason.
    let refused =
        write(json!([one("recipes[1].sugar", json!(7)), one("recipes[2].sugar", json!(501))]));
    assert_eq!(refused.status, 409);
    let refused = refused.json();
    assert_eq!(refused["mistakes"][0]["operand"], "recipes[2].sugar", "{refused}");
    assert_eq!(value(&web, "recipes[1].sugar"), 200);
    // Nothing but the parts of the recipe comes with it.
    let secret = write(json!([one("recipes[0].sugar", json!(1)), one("secret", json!(1))]));
    assert!(secret.status == 400 && secret.body.contains("is no part of"), "{secret:?}");
    assert_eq!((value(&web, "recipes[0].sugar"), value(&web, "secret")), (150.into(), 0.into()));
}

#[test]
fn a_wrong_recipe_or_file_is_refused_with_its_place() {
    let (web, anna) = bakery();
    for (file, words) in [
        ("recipes = [\n  { sugar = }\n]", "line 2"),
        ("secret = 5", "no value of `recipes`"),
        ("", "no value of `recipes`"),
        ("recipes = 5\nrecipes = 6", "line 2"),
    ] {
        let read =
            web.post("/api/recipe/read", &anna, &json!({ "operand": "recipes", "file": file }));
        let error = read.json()["error"].to_string();
        assert!(read.status == 400 && error.contains(words), "{file}: {read:?}");
    }
    for said in [
        json!({ "operand": "recipes", "writes": [] }),
        json!({ "operand": "recipes" }),
        json!({ "operand": "secret", "writes": [{ "operand": "secret", "value": 1 }] }),
        json!({ "operand": "recipes", "writes": [{ "operand": "recipes[9].sugar", "value": 1 }] }),
        json!({ "operand": "recipes", "writes": [{ "operand": 5, "value": 1 }] }),
    ] {
        let refused = web.post("/api/recipe", &anna, &said);
        assert!([400, 409].contains(&refused.status), "{said}: {refused:?}");
    }
    let many: Vec<Value> =
        (0..9000).map(|_| json!({ "operand": "recipes[0].sugar", "value": 1 })).collect();
    let many = web.post("/api/recipe", &anna, &json!({ "operand": "recipes", "writes": many }));
    assert!([400, 409].contains(&many.status), "{many:?}");
}

#[test]
fn a_recipe_of_the_service_is_refused_to_who_operates_before_the_controller_is_asked() {
    let controller = CONTROLLER.replace("write =", "write-service =");
    let user = "[[user]]\nname = \"anna\"\nrole = \"operate\"\n";
    let zoe = "[[user]]\nname = \"zoe\"\nrole = \"service\"\n";
    let (web, anna) = signed_in(LADDER, &format!("{controller}{user}{zoe}"));
    let writes = json!([{ "operand": "recipes[0].sugar", "value": 1 }]);
    let said = json!({ "operand": "recipes", "writes": writes });
    let refused = web.post("/api/recipe", &anna, &said);
    assert_eq!(refused.status, 403, "{refused:?}");
    assert!(refused.body.contains("this needs the role `service`"), "{refused:?}");
}
