//! The report in a browser: it opens without a network and without complaints, its plots hold
//! data, its table changes its measure, its flights can be turned, its labels do not lie on each other,
//! its text can be read on white and on dark, no window is too narrow for it, and names of rows stay in view.
//!
//! Needs Chromium, which `tests/setup.sh` installs; without it the test says that it was left out.

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
  said.figures = [...document.querySelectorAll("figure > .scroll > svg")].map(svg => svg.querySelectorAll("polyline,polygon,path,circle,rect").length);
  const out = document.createElement("pre");
  out.id = "said";
  out.textContent = JSON.stringify(said);
  document.body.append(out);
});
</script></body>"##;

/// Of the same page in windows of several widths.
const FRAMES: &str = include_str!("browser/frames.html");
const MEASURE: &str = include_str!("browser/measure.js");

fn browser() -> Option<PathBuf> {
    let named = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())
        .flat_map(|folder| named.map(|name| folder.join(name)))
        .find(|path| path.is_file())
}

/// Loads `page` on a system that is dark or not, and returns what its script wrote down and what the console
/// said.
fn open(browser: &Path, page: &Path, dark: bool) -> (serde_json::Value, String) {
    let profile = tempfile::tempdir().unwrap();
    let scheme = if dark { 0 } else { 1 };
    let output = Command::new(browser)
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
        .arg(format!("--blink-settings=preferredColorScheme={scheme}"))
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("Chromium starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let console = said
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect::<Vec<_>>()
        .join("\n");
    let document = String::from_utf8_lossy(&output.stdout);
    let start = document
        .find("<pre id=\"said\">")
        .expect("the page's script ran")
        + 15;
    let end = start + document[start..].find("</pre>").unwrap();
    let written = document[start..end]
        .replace("&gt;", ">")
        .replace("&lt;", "<");
    let written = written.replace("&amp;", "&");
    (serde_json::from_str(&written).unwrap(), console)
}

#[test]
fn the_page_opens_turns_holds_data_and_can_be_read() {
    let Some(browser) = browser() else {
        eprintln!(
            "LEFT OUT: the report was not opened, there is no Chromium; tests/setup.sh installs it"
        );
        return;
    };
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
            "ekf,bnkf,ekf-tuned,converted,imm10,recursive",
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
    let (said, console) = open(&browser, &read, false);
    assert_eq!(console, "", "the console complained");
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
    assert_eq!(cells.len(), 6 * 9);
    assert!(
        cells
            .iter()
            .all(|cell| cell.as_str().unwrap().ends_with('%')),
        "{cells:?}"
    );
    assert!(said["best"].as_u64().unwrap() >= 9);
    let figures = said["figures"].as_array().unwrap();
    assert_eq!(figures.len(), 15);
    assert!(
        figures.iter().all(|shapes| shapes.as_u64().unwrap() > 10),
        "{figures:?}"
    );
    let script = format!("<script>\n{MEASURE}</script></body>");
    let measured = page.replace("</body>", &script);
    std::fs::write(folder.path().join("measured.html"), measured).unwrap();
    let frames = folder.path().join("frames.html");
    std::fs::write(&frames, FRAMES).unwrap();
    for dark in [false, true] {
        let (windows, console) = open(&browser, &frames, dark);
        assert_eq!(console, "", "the console complained");
        assert_eq!(windows.as_array().unwrap().len(), 3);
        for window in windows.as_array().unwrap() {
            let at = format!("{} pixels wide, dark: {dark}", window["width"]);
            assert_eq!(window["wider"], 0, "the page scrolls sideways, {at}");
            assert!(window["labels"].as_u64().unwrap() > 300, "{at}");
            let names = window["names"].as_u64().unwrap();
            assert_eq!(names > 40, window["width"] == 400, "{names} names, {at}");
            for fault in ["overlaps", "cut", "hard", "gone"] {
                assert_eq!(window[fault], serde_json::json!([]), "{fault}, {at}");
            }
        }
    }
}
