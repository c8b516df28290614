//! Compares the paper's claims with measurements.

use super::measure::Measurements;
use super::rows::{AGTAO, AO_NET, GTAO, GTAO_TUNED, HD, SIZES};
use aonet::Size;
use serde::Serialize;

/// Whether a claim is reproduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It holds.
    Reproduced,
    /// It does not hold.
    NotReproduced,
    /// A required number is missing.
    NotMeasured,
}

impl Verdict {
    /// As text.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reproduced => "reproduced",
            Self::NotReproduced => "not reproduced",
            Self::NotMeasured => "not measured",
        }
    }
}

/// One claim of the paper.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Claim {
    /// The claim with the paper's numbers.
    pub paper: String,
    /// Our numbers; empty if there are none.
    pub ours: String,
    /// Whether it holds.
    pub verdict: Verdict,
}

impl Claim {
    /// `verdict` from `holds`, which is absent where a number is missing.
    pub fn new(paper: impl Into<String>, holds: Option<(bool, String)>) -> Self {
        let (verdict, ours) = match holds {
            None => (Verdict::NotMeasured, String::new()),
            Some((true, ours)) => (Verdict::Reproduced, ours),
            Some((false, ours)) => (Verdict::NotReproduced, ours),
        };
        Self { paper: paper.into(), ours, verdict }
    }

    /// One line: claim, our numbers, verdict.
    pub fn line(&self) -> String {
        let ours = if self.ours.is_empty() { String::new() } else { format!("{}: ", self.ours) };
        format!("{} -> ours: {ours}{}", self.paper, self.verdict.name())
    }
}

/// SSIM and PSNR (dB) of a row.
fn quality(m: &Measurements, key: &str) -> Option<[f64; 2]> {
    let row = m.row(key)?;
    Some([row.ssim()?.mean, row.psnr()?.mean])
}

fn ms(m: &Measurements, key: &str, size: Size) -> Option<f64> {
    m.row(key)?.ms_at(size)
}

/// Whether `better` is above every one of `worse` in SSIM and in PSNR.
fn above(m: &Measurements, better: &str, worse: &[&str]) -> Option<(bool, String)> {
    let best = quality(m, better)?;
    let others: Vec<[f64; 2]> = worse.iter().map(|k| quality(m, k)).collect::<Option<_>>()?;
    let holds = others.iter().all(|o| best[0] > o[0] && best[1] > o[1]);
    let show = |q: &[f64; 2]| format!("{:.4} / {:.2} dB", q[0], q[1]);
    let others: Vec<String> = others.iter().map(show).collect();
    Some((holds, format!("{} against {}", show(&best), others.join(" and "))))
}

/// Whether `fast` takes less time than every one of `slow` at each of `sizes`.
fn faster(m: &Measurements, fast: &str, slow: &[&str], sizes: &[Size]) -> Option<(bool, String)> {
    let mut holds = true;
    let mut shown = Vec::new();
    for &size in sizes {
        let time = ms(m, fast, size)?;
        let others: Vec<f64> = slow.iter().map(|k| ms(m, k, size)).collect::<Option<_>>()?;
        holds &= others.iter().all(|o| time < *o);
        let others: Vec<String> = others.iter().map(|o| format!("{o:.1}")).collect();
        shown.push(format!("{time:.1} ms against {} at {size}", others.join(" and ")));
    }
    Some((holds, shown.join(", ")))
}

/// Whether the run-time of `key` is at most `most` times that of `base`.
fn at_most(m: &Measurements, key: &str, base: &str, most: f64) -> Option<(bool, String)> {
    let ratio = ms(m, key, HD)? / ms(m, base, HD)?;
    Some((ratio <= most, format!("{:.0} % of the time", 100.0 * ratio)))
}

/// The claims about Table 1.
pub fn table_1(m: &Measurements) -> Vec<Claim> {
    let learned = ["deep_ao", "deep_shading"];
    vec![
        Claim::new(
            "§4.2: AO-Net is above both learned baselines in SSIM and PSNR (0.9802 / 32.59 dB against 0.9470 / 24.40 and 0.9597 / 25.71)",
            above(m, AO_NET, &learned),
        ),
        Claim::new("§4.2: AO-Net is above GTAO (0.9767 / 26.10 dB)", above(m, AO_NET, &[GTAO])),
        Claim::new("the same of GTAO tuned", above(m, AO_NET, &[GTAO_TUNED])),
        Claim::new("ours is above GTAO tuned", above(m, "ours", &[GTAO_TUNED])),
        Claim::new("ours is above the attenuated GTAO that it corrects", above(m, "ours", &[AGTAO])),
        Claim::new(
            "§4.2: AO-Net is faster than both learned baselines (3.92 ms against 3.98 and 6.09)",
            faster(m, AO_NET, &learned, &[HD]),
        ),
        Claim::new(
            "Table 1: Deep Shading is above DeepAO in SSIM and PSNR",
            above(m, "deep_shading", &["deep_ao"]),
        ),
        Claim::new("§3.2: the network takes less than 1.5 MB", small(m)),
    ]
}

fn small(m: &Measurements) -> Option<(bool, String)> {
    let bytes = m.row(AO_NET)?.f16_bytes?;
    Some((bytes < 1_500_000, format!("{:.2} MB as half floats", bytes as f64 / 1e6)))
}

/// The claims about Table 2.
pub fn table_2(m: &Measurements) -> Vec<Claim> {
    vec![
        Claim::new(
            "§4.2.1: AO-Net is faster than Deep Shading at every size",
            faster(m, AO_NET, &["deep_shading"], &SIZES),
        ),
        Claim::new(
            "§4.2.1: AO-Net is faster than DeepAO at the two larger sizes",
            faster(m, AO_NET, &["deep_ao"], &SIZES[1..]),
        ),
    ]
}

/// The claims about Table 3.
pub fn table_3(m: &Measurements) -> Vec<Claim> {
    let with_depth = ["normal_depth", "normal_depth_normalized"];
    vec![
        Claim::new("§4.2.2: normals alone have the highest SSIM and PSNR", above(m, AO_NET, &with_depth)),
        Claim::new("§4.2.2: normals alone take the shortest time", faster(m, AO_NET, &with_depth, &[HD])),
        Claim::new(
            "§4.2.2: depth does worse when it is not normalised (30.51 against 32.45 dB)",
            above(m, "normal_depth_normalized", &["normal_depth"]),
        ),
    ]
}

/// The claims about Table 4.
pub fn table_4(m: &Measurements) -> Vec<Claim> {
    // The paper loses 33.40 - 30.94 = 2.46 dB.
    let loss = || {
        let lost = quality(m, "base")?[1] - quality(m, "base_patch")?[1];
        Some((lost <= 2.5, format!("{lost:.2} dB")))
    };
    vec![
        Claim::new(
            "§4.2.2: patches reduce the time to 18 % (at most 20 % of Base)",
            at_most(m, "base_patch", "base", 0.2),
        ),
        Claim::new("Table 4: patches lose 2.46 dB (at most 2.5 dB)", loss()),
        Claim::new(
            "Table 4: kernels raise SSIM and PSNR with patches (0.9732 / 30.94 to 0.9802 / 32.59 dB)",
            above(m, AO_NET, &["base_patch"]),
        ),
        Claim::new(
            "Table 4: kernels raise SSIM and PSNR without patches (0.9880 / 33.40 to 0.9887 / 35.50 dB)",
            above(m, "base_kernel", &["base"]),
        ),
        Claim::new(
            "Table 4: kernels take 109 % of the time without, with patches (at most 115 %)",
            at_most(m, AO_NET, "base_patch", 1.15),
        ),
        Claim::new(
            "Table 4: kernels without patches have the highest quality",
            above(m, "base_kernel", &["base", "base_patch", AO_NET]),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::fixtures::measurements;

    fn verdicts(claims: &[Claim]) -> Vec<Verdict> {
        claims.iter().map(|c| c.verdict).collect()
    }

    #[test]
    fn claims_hold_or_fail_with_the_numbers() {
        use Verdict::{NotReproduced, Reproduced};
        // Row, SSIM, PSNR, ms.
        let paper = measurements(&[
            ("base", 0.9880, 33.40, 20.55),
            ("base_patch", 0.9732, 30.94, 3.60),
            ("base_kernel", 0.9887, 35.50, 22.78),
            ("ao_net", 0.9802, 32.59, 3.92),
            ("deep_ao", 0.9470, 24.40, 3.98),
            ("deep_shading", 0.9597, 25.71, 6.09),
            ("normal_depth", 0.9743, 30.51, 4.22),
            ("normal_depth_normalized", 0.9786, 32.45, 4.22),
            (GTAO, 0.9767, 26.10, 1.0),
            (GTAO_TUNED, 0.9767, 26.10, 1.0),
            (AGTAO, 0.9767, 26.10, 1.0),
            ("ours", 0.99, 34.0, 4.0),
        ]);
        assert_eq!(verdicts(&table_1(&paper)), [Reproduced; 8], "the paper agrees with itself");
        assert!(
            verdicts(&table_3(&paper)).iter().chain(&verdicts(&table_4(&paper))).all(|v| *v == Reproduced)
        );
        let reversed = measurements(&[
            ("base", 0.99, 36.0, 4.0),
            ("base_patch", 0.98, 33.0, 4.0),
            ("base_kernel", 0.98, 35.0, 5.0),
            ("ao_net", 0.97, 32.0, 5.0),
            ("deep_ao", 0.98, 24.40, 3.98),
            ("deep_shading", 0.96, 33.0, 4.0),
            ("normal_depth", 0.98, 34.0, 4.0),
            ("normal_depth_normalized", 0.97, 33.0, 4.0),
            (GTAO, 0.98, 33.0, 1.0),
            (GTAO_TUNED, 0.98, 34.0, 1.0),
            (AGTAO, 0.98, 34.0, 1.0),
            ("ours", 0.97, 33.0, 4.0),
        ]);
        // The claim about the network's size is not reversed.
        let all = [table_1(&reversed)[..7].to_vec(), table_3(&reversed), table_4(&reversed)].concat();
        assert!(all.iter().all(|c| c.verdict == NotReproduced), "{all:#?}");
    }

    #[test]
    fn what_was_not_measured_is_not_judged() {
        let nothing = Measurements::default();
        let all = [table_1(&nothing), table_2(&nothing), table_3(&nothing), table_4(&nothing)].concat();
        assert!(all.iter().all(|c| c.verdict == Verdict::NotMeasured));
        assert!(all[0].line().ends_with("-> ours: not measured"), "{}", all[0].line());
        let claim = Claim::new("P", Some((false, "3 dB".into())));
        assert_eq!(claim.line(), "P -> ours: 3 dB: not reproduced");
    }

    #[test]
    fn speed_is_compared_at_every_size() {
        let mut m = measurements(&[("ao_net", 0.9, 20.0, 4.0), ("deep_shading", 0.9, 20.0, 6.0)]);
        for (key, ms) in [("ao_net", [2.0, 12.0]), ("deep_shading", [3.0, 11.0])] {
            let row = m.rows.get_mut(key).unwrap();
            row.ms.insert("540x540".into(), ms[0]);
            row.ms.insert("2048x1024".into(), ms[1]);
        }
        assert_eq!(table_2(&m)[0].verdict, Verdict::NotReproduced);
        m.rows.get_mut("ao_net").unwrap().ms.insert("2048x1024".into(), 10.0);
        assert_eq!(verdicts(&table_2(&m)), [Verdict::Reproduced, Verdict::NotMeasured]);
    }
}
