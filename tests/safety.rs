//! No way of losing the process, the link or the operator leaves the arm moving; and what `docs/safety.md` says is shown.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test stops at the first surprise"
)]
#![allow(clippy::print_stderr, reason = "a test says what it measured")]

#[path = "safety/resume.rs"]
mod resume;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The rows of the table of hazards: four cells each.
fn hazards() -> Vec<Vec<String>> {
    let text = fs::read_to_string(root().join("docs/safety.md")).unwrap();
    let table =
        text.split("| hazard | cause | mitigation | shown by |").nth(1).expect("the table of hazards");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    rows.map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// Every `file`: `test` of a cell.
fn tests_of(cell: &str) -> Vec<(PathBuf, String)> {
    let quoted: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
    quoted.chunks(2).map(|pair| (root().join(pair[0]), pair[1].to_owned())).collect()
}

fn is_a_test(file: &Path, name: &str) -> bool {
    let text = fs::read_to_string(file).unwrap_or_default();
    text.split("#[test]").skip(1).any(|after| {
        let head = after.split('{').next().unwrap_or_default();
        head.contains(&format!("fn {name}("))
    })
}

#[test]
fn every_test_that_the_table_of_hazards_names_exists() {
    let rows = hazards();
    assert!(rows.len() >= 25, "only {} hazards were read", rows.len());
    let mut named = BTreeSet::new();
    for row in &rows {
        assert_eq!(row.len(), 4, "{row:?}");
        assert!(row.iter().all(|cell| !cell.is_empty()), "{row:?}");
        let tests = tests_of(&row[3]);
        assert!(!tests.is_empty(), "nothing shows the mitigation of: {}", row[0]);
        for (file, name) in tests {
            assert!(is_a_test(&file, &name), "{}: no test is called {name}", file.display());
            named.insert(name);
        }
    }
    assert!(!is_a_test(&root().join("robot/src/guard/tests.rs"), "a_test_that_nobody_wrote"));
    assert!(named.len() >= 20, "only {} tests", named.len());
}

#[test]
fn the_first_words_are_that_it_is_a_research_tool_and_that_the_physical_stop_comes_first() {
    let text = fs::read_to_string(root().join("docs/safety.md")).unwrap();
    let first: String = text.lines().skip(2).take(4).collect::<Vec<_>>().join(" ");
    for words in ["research tool, not a medical device", "physical emergency stop comes first"] {
        assert!(first.contains(words), "{first}");
    }
}

/// Everything that can be lost, lost once: the process and the link over the wire, in wall time, since a killed process
/// has no other.
#[test]
fn whatever_is_lost_the_arm_is_at_rest_within_100_ms_and_stays() {
    let probepath = Path::new(env!("CARGO_BIN_EXE_probepath"));
    let goals = probepath_scripts::validate::safety(1, probepath, &()).unwrap();
    eprintln!("{goals}");
    // How soon lost contact is noticed is the contact's own figure, over ten seeds and all skins.
    let own = goals.rows.iter().filter(|row| !row.figure.starts_with("contact lost"));
    let missed: Vec<_> = own.filter(|row| row.met == Some(false)).collect();
    assert!(goals.rows.len() > 25 && missed.is_empty(), "{missed:#?}");
    assert!(goals.rows.iter().all(|row| row.counted > 0));
}
