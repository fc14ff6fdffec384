//! Element documentation of a Do-more: as tags, and back.

use rungd_import::domore;
use rungd_import::model::ForeignProject;

use crate::plant;

const FILE: &str = "\u{feff}#BEGIN ELEMENT_DOC\r\n\
    \"X0\",\"FLAGS = REST_READONLY SPARK_DISABLED OPCUA_DISABLED\",\"Start\",\"S1\",\"Start, NO\"\r\n\
    \"Y10\",\"FLAGS = REST_READONLY SPARK_DISABLED OPCUA_DISABLED\",\"\",\"\",\"Lamp \"\"run\"\"\"\r\n\
    \"V10:3\",\"FLAGS = REST_READONLY SPARK_DISABLED OPCUA_DISABLED\",\"Ready\",\"\",\"\"\r\n\
    \"T0\",\"FLAGS = REST_READONLY OPCUA_DISABLED\",\"T_NetStable\",\"\",\"10s stability timer\"\r\n\
    \"D7\",\"FLAGS = REST_READONLY SPARK_DISABLED OPCUA_DISABLED\",\"MOVE\",\"\",\"\"\r\n\
    #END\r\n";

fn documented(lines: &str) -> ForeignProject {
    domore::read(&format!("#BEGIN ELEMENT_DOC\n{lines}\n#END\n")).unwrap()
}

#[test]
fn nicknames_become_tags_with_their_addresses() {
    let project = domore::read(FILE).unwrap();
    let tags: Vec<String> = project.files[0]
        .tags
        .iter()
        .map(|tag| format!("{} {} {}", tag.name, tag.at.as_ref().unwrap(), tag.doc))
        .collect();
    assert_eq!(
        tags,
        [
            "Start X0 Start, NO [S1]",
            "y_10 Y10 Lamp \"run\"",
            "Ready V10.3 ",
            "T_NetStable T0 10s stability timer",
            "MOVE_tag D7 "
        ]
    );
    assert!(!project.outcome.is_open());
    assert_eq!(plant::errors(&project), "");
}

#[test]
fn what_comes_back_is_what_was_read() {
    let project = domore::read(FILE).unwrap();
    let made = domore::documentation(&plant::loaded(&project).program.unwrap());
    let wanted = FILE.trim_start_matches('\u{feff}').replace("\"MOVE\"", "\"MOVE_tag\"");
    let mut lines: Vec<&str> = wanted.lines().collect();
    let mut found: Vec<&str> = made.text.lines().collect();
    // The tags of a program are in the order of their names.
    lines.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, lines);
    assert_eq!((made.elements, made.left_out.len()), (5, 0));
}

#[test]
fn elements_without_a_place_are_open_points() {
    let project = documented(
        "\"WX0\",\"Flow\",\"\",\"\"\n\"N3\",\"Index\",\"\",\"\"\n\"ST0\",\"$FirstScan\",\"\",\"\"\n\
         \"st1\",\"$On\",\"\",\"\"\n\
         \"X5000\",\"Far\",\"\",\"\"\n\"X1\",\"One\",\"\",\"\"\n\"X1\",\"Two\",\"\",\"\"",
    );
    assert_eq!(project.files[0].tags.len(), 1);
    let open = project.outcome.open.join("\n");
    for wanted in ["WX0 Flow", "N3 Index", "X5000 Far", "X1 Two"] {
        assert!(open.contains(wanted), "{open}");
    }
    let left_out = &project.outcome.left_out;
    assert_eq!(left_out.len(), 1);
    assert!(left_out[0].starts_with("2 elements of the system"), "{left_out:?}");
}

#[test]
fn tags_that_are_no_elements_are_named_in_what_is_written() {
    let text = "[tags]\na_very_long_name_of_a_tag = { at = \"C1\", doc = \"Why\" }\nfree = { type \
                = \"int\" }\n[[program]]\nname = \"Main\"\nrung = [ { when = \
                [\"a_very_long_name_of_a_tag\"], do = [\"MOVE 1 to=free\"] } ]\n";
    let mut project = documented("\"X0\",\"Start\",\"\",\"\"");
    project.parts.push(rungd_import::model::ProjectPart { name: "other", text });
    project.files.clear();
    let made = domore::documentation(&plant::loaded(&project).program.unwrap());
    assert!(made.text.contains(",\"\",\"a_very_long_name_of_a_tag\",\"Why\"\r\n"), "{}", made.text);
    assert_eq!(made.left_out.len(), 2, "{:?}", made.left_out);
}

#[test]
fn a_file_without_documentation_is_refused_with_its_line() {
    for (text, wanted) in [
        ("a,b\n", "no line is `#BEGIN ELEMENT_DOC`"),
        ("x\n#BEGIN ELEMENT_DOC\n\"X0\"\n", "line 3: an element has its name"),
        ("#BEGIN ELEMENT_DOC\n\"X0,\n", "a quotation mark is missing"),
    ] {
        let why = domore::read(text).unwrap_err();
        assert!(why.contains(wanted), "{why}");
    }
}
