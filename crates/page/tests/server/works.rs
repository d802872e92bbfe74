//! Work as child processes, seen by several who look at the same page.
#![cfg(unix)]

use crate::asked::serve;

#[test]
fn two_browsers_see_the_same_work_and_cannot_begin_it_twice() {
    let page = serve(
        r#"echo '{"event":"started","stage":"segment","total":3}'; echo '{"event":"warning","stage":"check","message":"few <b>points</b>"}'; while [ ! -e go ]; do sleep 0.05; done; echo '{"event":"run","value":{"folder":"x"}}'"#,
    );
    let id = page.begin(r#"{"kind":"run","site":"pier"}"#);
    let second = page.post("/api/jobs", r#"{"kind":"run","site":"pier"}"#);
    assert_eq!((second.status, second.error().as_str()), (409, "at-work"));
    let other = page.get("/api/state").json();
    assert_eq!(other["jobs"][0]["id"], id);
    // As a page does that is loaded again in the middle.
    let mut seen = page.get(&format!("/api/jobs/{id}/since/0")).json();
    while seen["warnings"].as_array().unwrap().is_empty() {
        seen = page.get(&format!("/api/jobs/{id}/since/{}", seen["version"])).json();
    }
    assert_eq!(
        (seen["state"].as_str(), seen["stages"][0]["stage"].as_str()),
        (Some("running"), Some("segment"))
    );
    std::fs::write(page.root.join("go"), "").unwrap();
    let end = page.ended(id);
    assert_eq!(
        (end["state"].as_str(), end["results"]["run"]["folder"].as_str()),
        (Some("done"), Some("x"))
    );
}

#[test]
fn work_that_is_stopped_fails_or_dies_says_so() {
    let page = serve(
        r#"case "$*" in *check*) echo "tsumu: one
tsumu: two" >&2; exit 2;; *init*) kill -9 $$;; *) echo '{"event":"started","stage":"segment","total":3}'; exec sleep 600;; esac"#,
    );
    let run = page.begin(r#"{"kind":"run","site":"pier"}"#);
    page.get(&format!("/api/jobs/{run}/since/1"));
    assert_eq!(page.post(&format!("/api/jobs/{run}/stop"), "{}").status, 200);
    assert_eq!(page.ended(run)["state"], "stopped");
    let check = page.begin(r#"{"kind":"check","site":"pier"}"#);
    let end = page.ended(check);
    assert_eq!(end["state"], "failed");
    assert_eq!(end["errors"].as_array().unwrap().len(), 2, "every reason: {end}");
    let init = page.begin(r#"{"kind":"init","files":["pier/a.xyz"],"block":"cube 1m","name":"n"}"#);
    assert_eq!(page.ended(init)["state"], "died");
    assert_eq!(page.get("/api/jobs/99/since/0").status, 404);
}

#[test]
fn arguments_are_arguments_whatever_they_say() {
    let page = serve(r#"for a in "$@"; do printf '%s\n' "$a" >> said; done"#);
    let name = "$(touch hacked); --help =cmd|'/c calc'!A1";
    let order = serde_json::json!({ "kind": "init", "files": ["pier/a.xyz"], "block": "--out /x", "name": name });
    page.ended(page.begin(&order.to_string()));
    let said = std::fs::read_to_string(page.root.join("said")).unwrap();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!((lines[0], lines[1], lines[2]), ("--json", "init", "--block=--out /x"));
    assert_eq!(lines[5], "--", "files come after it");
    assert!(!page.has("hacked"));
}

#[test]
fn a_run_that_was_taken_away_is_named_and_the_site_is_as_it_was() {
    let page = serve("exit 0");
    std::fs::create_dir_all(page.root.join("pier/run/recognise")).unwrap();
    for file in ["manifest.json", "recognise/blocks.csv", "report.html"] {
        std::fs::write(page.root.join("pier/run").join(file), "{}").unwrap();
    }
    assert_eq!(page.get("/api/site/pier").json()["runs"][0]["name"], "run");
    assert_eq!(page.get("/view/pier/run/report.html").status, 200);
    std::fs::remove_dir_all(page.root.join("pier/run")).unwrap();
    let gone = page.get("/view/pier/run/report.html");
    assert!(gone.status == 404 && gone.body.contains("not there any more"));
    assert_eq!(page.get("/api/results/pier/run").error(), "gone");
    assert_eq!(page.get("/api/site/pier").json()["runs"].as_array().unwrap().len(), 0);
}

#[test]
fn of_two_who_change_a_site_the_second_is_told() {
    let page = serve("exit 0");
    let mut first = page.get("/api/site/pier").json()["draft"].clone();
    let second = first.clone();
    first["site"]["name"] = "=cmd|'/c calc'!A1 <script>".into();
    let saved = page.post("/api/site/pier", &first.to_string());
    assert_eq!(saved.status, 200, "{}", saved.body);
    let late = page.post("/api/site/pier", &second.to_string());
    assert!(late.status == 400 && late.body.contains("changed elsewhere"), "{}", late.body);
    // And the first goes on with its new revision.
    first["revision"] = saved.json()["revision"].clone();
    assert_eq!(page.post("/api/site/pier", &first.to_string()).status, 200);
    assert_eq!(page.get("/api/state").json()["sites"][0]["name"], "=cmd|'/c calc'!A1 <script>");
    let review =
        page.post("/api/site/pier/review", "{\"format\":1,\"reviewer\":\"\",\"blocks\":[]}");
    assert_eq!(review.status, 200, "{}", review.body);
    assert_eq!(page.post("/api/site/pier/review", "<script>").status, 400);
    assert_eq!(page.get("/api/site/pier/review").json()["format"], 1);
}
