//! Tables, figures and the page, from tiny networks and a tiny dataset.

use super::*;
use aonet::net::{Features, KernelWeights, ModelConfig};
use std::path::Path;

fn models(dir: &Path) -> Models {
    let paper = ModelConfig::paper;
    for name in ["ao_net", "ao_net-2", "softmax-7", "my_own"] {
        fixtures::save_model(dir, name, paper());
    }
    fixtures::save_model(dir, "ours", ModelConfig::correcting());
    let depth = ModelConfig { features: Features::normal_depth_normalized(), ..paper() };
    fixtures::save_model(dir, "normal_depth_normalized", depth);
    fixtures::save_model(dir, "base_patch", ModelConfig { kernel: KernelWeights::Off, ..paper() });
    Models::load(dir).unwrap()
}

fn quiet(_: &str, _: usize, _: usize) {}

fn all_sections(dir: &Path, items: &[Item]) -> Vec<Section> {
    let (frames, rows) = (dir.join("frames"), dir.join("rows"));
    std::fs::create_dir_all(&rows).unwrap();
    let (manifest, models) = (fixtures::dataset(&frames), models(&rows));
    let subject =
        Subject { manifest: Some(&manifest), models: &models, threads: 1, runs: 1, command: "aonet paper" };
    make(items, &subject, &quiet).unwrap()
}

fn row<'a>(section: &'a Section, label: &str) -> &'a [String] {
    let Content::Table { rows, .. } = &section.content else { panic!("a table") };
    rows.iter().find(|r| r[0] == label).unwrap_or_else(|| panic!("{label} in {rows:?}"))
}

#[test]
fn tables_have_trained_and_missing_rows() {
    let dir = tempfile::tempdir().unwrap();
    let sections = all_sections(dir.path(), &[Item::Table1, Item::Table4, Item::Ablations]);
    let [table1, table4, ablations] = &sections[..] else { panic!("three tables") };
    assert_eq!(row(table1, "DeepAO")[1..6], ["not trained", "-", "-", "-", "-"]);
    assert_eq!(row(table1, "DeepAO")[6..9], ["0.9470", "24.40", "3.98"]);
    let gtao = row(table1, "GTAO, XeGTAO's High");
    // The best of a column is bold; the fastest row varies.
    let number = |cell: &str| cell.trim_matches('*').parse::<f64>();
    assert!(number(&gtao[1]).is_ok() && number(&gtao[5]).is_ok_and(|ms| ms > 0.0), "{gtao:?}");
    assert_eq!(gtao[9..], ["-", "-", "-", "-", "-"]);
    assert!(row(table1, "AO-Net (paper's network)")[1].contains(" ±"), "two seeds");
    assert!(!row(table1, "ours")[1].contains('±'), "one seed");
    assert_eq!(row(table1, "ours")[12..], ["12", "-"]);
    let constant = row(table1, "constant image 0.750");
    assert!(number(&constant[1]).is_ok() && constant[5] == "-", "{constant:?}");
    assert_eq!(row(table4, "Base+Patch+Kernel")[1..5], row(table1, "AO-Net (paper's network)")[1..5]);
    assert_eq!(row(table4, "Base (U-Net)")[1], "not trained");
    assert!(
        row(ablations, "my_own")[1] != "not trained" && row(ablations, "kernels that sum to one").len() == 11
    );
    assert_eq!(row(ablations, "crops of 128, loss: DSSIM, VGG-19 relu1_2")[1], "not trained");
    let json = |key: &str| {
        let rows = table1.json["rows"].as_array().unwrap();
        rows.iter().find(|r| r["row"] == key).unwrap()
    };
    assert_eq!(json("deep_ao")["trained"], false);
    assert!(json("ao_net")["ssim"]["spread"].as_f64().is_some(), "{}", table1.json);
    let text = table1.markdown();
    assert!(
        text.contains("not trained")
            && text.contains("not measured")
            && text.contains("4 of the split `test`"),
        "{text}"
    );
}

#[test]
fn run_times_need_no_frames() {
    let dir = tempfile::tempdir().unwrap();
    let models = models(dir.path());
    let subject = Subject { manifest: None, models: &models, threads: 1, runs: 1, command: "aonet paper" };
    let sections = make(&[Item::Table2], &subject, &quiet).unwrap();
    let times = row(&sections[0], "AO-Net (paper's network)");
    assert!(
        times[1..4].iter().all(|ms| ms.trim_matches('*').parse::<f64>().is_ok_and(|ms| ms > 0.0)),
        "{times:?}"
    );
    assert_eq!(row(&sections[0], "Deep Shading")[1..7], ["not trained", "-", "-", "3.56", "6.09", "11.35"]);
    let message = make(&[Item::Table1], &subject, &quiet).unwrap_err().to_string();
    assert!(message.contains("table1") && message.contains("dataset"), "{message}");
}

#[test]
fn only_test_frames_are_used() {
    let dir = tempfile::tempdir().unwrap();
    let mut manifest = fixtures::dataset(dir.path());
    manifest.frames.iter_mut().for_each(|f| f.split = Split::Train);
    let models = Models::default();
    let subject = Subject { manifest: Some(&manifest), models: &models, threads: 1, runs: 1, command: "" };
    assert!(make(&[Item::Table1], &subject, &quiet).unwrap_err().to_string().contains("test"));
}

#[test]
fn figures_and_the_page_are_complete_and_need_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let items = [Item::Table3, Item::Fig2, Item::Fig5, Item::Fig6, Item::Fig7, Item::Fig8];
    let sections = all_sections(dir.path(), &items);
    for (section, (rows, columns)) in sections[2..].iter().zip([(2, 5), (2, 4), (4, 6), (2, 6)]) {
        let Content::Pictures { panels, columns: found } = &section.content else { panic!("pictures") };
        assert_eq!((panels.len(), *found), (rows * columns, columns), "{:?}", section.item);
    }
    let networks = sections[1].json["networks"].as_object().unwrap();
    assert_eq!(networks.len(), 6, "one a row");
    assert_eq!(networks["normal_depth_normalized"]["channels"][3]["name"], "normalised depth");
    assert_ne!(sections[1].claims[0].verdict, claims::Verdict::NotMeasured);
    let out = dir.path().join("out");
    std::fs::create_dir(&out).unwrap();
    for section in &sections {
        assert!(save(section, &out).unwrap().exists());
        assert!(out.join(format!("{}.json", section.item.name())).exists());
    }
    let page = report(&sections).unwrap();
    assert_self_contained(&page);
    assert!(page.contains("DeepAO: not trained") && page.contains("<svg") && page.contains("viewport"));
    assert!(std::panic::catch_unwind(|| assert_self_contained("<img src=\"http://a/b.png\">")).is_err());
    assert!(std::panic::catch_unwind(|| assert_self_contained("<img src=\"fig7.png\">")).is_err());
}

/// Every resource is inside the page: no scripts, no style sheets, and every `src` and `url` is data.
fn assert_self_contained(page: &str) {
    for outside in ["<script", "<link", "<iframe", "@import", "href="] {
        assert!(!page.contains(outside), "{outside}");
    }
    for (mark, data) in [("src=\"", "data:"), ("url(", "data:")] {
        assert!(page.split(mark).skip(1).all(|rest| rest.starts_with(data)), "{mark}");
    }
    // The only address is the name of the SVG format, which is not fetched.
    let addresses = page.split("http").skip(1);
    assert!(addresses.into_iter().all(|rest| rest.starts_with("://www.w3.org/2000/svg\"")), "an address");
}

#[test]
fn equal_inputs_give_equal_figures() {
    let dir = tempfile::tempdir().unwrap();
    let items = [Item::Fig2, Item::Fig8];
    assert_eq!(all_sections(dir.path(), &items), all_sections(dir.path(), &items));
}
