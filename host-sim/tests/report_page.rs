//! The report in a browser: it opens without a network and without complaints, its plots hold
//! data, its table changes its measure, and its flights can be turned.
//!
//! Needs Chromium; `tests/setup.sh` installs it.

use std::path::{Path, PathBuf};
use std::process::Command;

const SCENARIO: &str = include_str!("../scenarios/paper.toml");

/// Does what a reader does, then writes down what came of it.
const READER: &str = r##"<script>
window.addEventListener("load", () => {
  const said = {};
  const canvas = document.getElementById("view");
  const inked = () => canvas.toDataURL();
  said.before = inked();
  const event = (name, x, y) => new PointerEvent(name, { clientX: x, clientY: y, pointerId: 1, bubbles: true });
  canvas.setPointerCapture = () => {};
  canvas.dispatchEvent(event("pointerdown", 100, 100));
  canvas.dispatchEvent(event("pointermove", 100, 100));
  said.home = canvas.dataset.yaw;
  canvas.dispatchEvent(event("pointermove", 220, 130));
  canvas.dispatchEvent(event("pointerup", 220, 130));
  said.turned = inked();
  said.yaw = canvas.dataset.yaw;
  const select = document.getElementById("flight");
  said.flights = select.options.length;
  select.value = "2";
  select.dispatchEvent(new Event("change"));
  said.other = inked();
  document.querySelector("#measures button[data-measure=coverage90]").click();
  said.cells = [...document.querySelectorAll("td[data-cell]")].map(cell => cell.textContent);
  said.best = document.querySelectorAll("td.best").length;
  said.figures = [...document.querySelectorAll("figure svg")].map(svg => svg.querySelectorAll("polyline,polygon,circle,rect").length);
  said.wide = document.documentElement.scrollWidth > document.documentElement.clientWidth + 1;
  const out = document.createElement("pre");
  out.id = "said";
  out.textContent = JSON.stringify(said);
  document.body.append(out);
});
</script></body>"##;

fn browser() -> PathBuf {
    let named = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())
        .flat_map(|folder| named.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    found.expect("Chromium is missing: tests/setup.sh installs it")
}

/// Loads `page` and returns the document after its scripts ran, and what the console said.
fn open(page: &Path, profile: &Path) -> (String, String) {
    let output = Command::new(browser())
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--no-first-run",
        ])
        .args([
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--enable-logging=stderr",
            "--virtual-time-budget=5000",
        ])
        .args(["--window-size=1280,900", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("Chromium starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let console = said
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect::<Vec<_>>()
        .join("\n");
    (
        String::from_utf8_lossy(&output.stdout).into_owned(),
        console,
    )
}

#[test]
fn the_page_opens_turns_and_holds_data() {
    let folder = tempfile::tempdir().unwrap();
    let tiny = SCENARIO
        .replace("quick_count = 30", "quick_count = 12")
        .replace("duration_s = 15.0", "duration_s = 4.0");
    std::fs::write(folder.path().join("tiny.toml"), tiny).unwrap();
    let status = Command::new(env!("CARGO_BIN_EXE_host-sim"))
        .current_dir(folder.path())
        .args([
            "evaluate", "--quick", "--folds", "2", "--epochs", "1", "--passes", "3",
        ])
        .args([
            "--tuning-flights",
            "4",
            "--methods",
            "ekf,bnkf,ekf-tuned,converted",
            "--scenario",
            "tiny.toml",
            "--out",
            "out",
        ])
        .status()
        .unwrap();
    assert!(status.success());

    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(!page.contains("{{"), "a place was not filled");
    for outside in ["src=", "href=\"http", "url(http", "@import", "fetch("] {
        assert!(
            !page.contains(outside),
            "{outside}: the page must not need a network"
        );
    }
    let read = folder.path().join("read.html");
    std::fs::write(&read, page.replace("</body>", READER)).unwrap();
    let (document, console) = open(&read, &folder.path().join("profile"));
    assert_eq!(console, "", "the console complained");

    let start = document
        .find("<pre id=\"said\">")
        .expect("the reader's script ran")
        + 15;
    let end = start + document[start..].find("</pre>").unwrap();
    let said: serde_json::Value = serde_json::from_str(&document[start..end]).unwrap();
    assert_eq!(said["flights"], 3);
    assert_ne!(said["before"], said["turned"], "the view did not turn");
    assert_ne!(
        said["turned"], said["other"],
        "another flight looks the same"
    );
    let yaw_rad = |name: &str| said[name].as_str().unwrap().parse::<f64>().unwrap();
    let turned_rad = yaw_rad("yaw") - yaw_rad("home");
    // 120 pixels of 8 mrad; four decimals are told.
    assert!((turned_rad - 0.96).abs() < 2e-4, "{turned_rad}");
    let cells = said["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 4 * 9);
    assert!(
        cells
            .iter()
            .all(|cell| cell.as_str().unwrap().ends_with('%')),
        "{cells:?}"
    );
    assert!(said["best"].as_u64().unwrap() >= 9);
    let figures = said["figures"].as_array().unwrap();
    assert_eq!(figures.len(), 13);
    assert!(
        figures.iter().all(|shapes| shapes.as_u64().unwrap() > 10),
        "{figures:?}"
    );
    assert_eq!(said["wide"], false, "the page is wider than the window");
}
