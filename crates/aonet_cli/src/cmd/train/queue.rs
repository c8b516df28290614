//! Every configuration of a folder, one after another.

use super::{Args, single};
use crate::output::{self, Style, number, table};
use anyhow::{Result, bail};
use aonet_lab::train::Frames;
use aonet_lab::train::queue::{QueueEnd, QueueEvent, QueuedRun, RunSummary, Selection, plan, train_all};
use indicatif::ProgressBar;
use std::path::Path;

pub(super) fn run(args: &Args, configs: &Path) -> Result<()> {
    let selection = Selection { seeds: args.seeds.clone(), only: args.only.clone() };
    let queue = plan(configs, &args.output, &selection)?;
    let manifests = single::manifests(args)?;
    let run = single::train_run(args, &manifests)?;
    let bar = single::bar(0);
    let ends = train_all(&queue, &mut Frames::new(&manifests), &run, &|run, event| show(&bar, run, event));
    bar.finish_and_clear();
    let summaries = queue.iter().map(QueuedRun::summary).collect::<Result<Vec<_>, _>>()?;
    if args.json {
        output::json(&summaries)?
    } else {
        output::text(&draw(&summaries))?
    }
    let failed = queue.iter().zip(&ends).filter(|(_, end)| matches!(end, QueueEnd::Failed(_)));
    let failed: Vec<_> = failed.map(|(run, _)| run.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("{} of {} runs failed: {}", failed.len(), queue.len(), failed.join(", "));
    }
    Ok(())
}

fn show(bar: &ProgressBar, run: &QueuedRun, event: QueueEvent) {
    let note = |text: String| bar.suspend(|| output::note(&format!("{}: {text}", run.name)));
    let steps = run.config.steps;
    match event {
        QueueEvent::Started(step) => {
            bar.reset();
            bar.set_length(steps);
            bar.set_position(step);
            note(match step {
                0 => format!("training {steps} steps"),
                _ => format!("continuing from step {step} of {steps}"),
            });
        }
        QueueEvent::Of(event) => single::show(bar, event),
        QueueEvent::Ended(QueueEnd::Skipped) => note(format!("skipped, has its {steps} steps")),
        QueueEvent::Ended(QueueEnd::Trained(step)) => note(format!("{step} of {steps} steps")),
        QueueEvent::Ended(QueueEnd::NotStarted) => note("not started, the time is over".into()),
        QueueEvent::Ended(QueueEnd::Failed(error)) => note(format!("failed: {error}")),
    }
}

/// One row a run; steps as taken/wanted where some are missing.
fn draw(summaries: &[RunSummary]) -> String {
    let cells = |run: &RunSummary| {
        let steps = if run.steps < run.of_steps {
            format!("{}/{}", run.steps, run.of_steps)
        } else {
            run.steps.to_string()
        };
        vec![
            run.name.clone(),
            steps,
            number(run.best.map(|b| b.loss), 4),
            number(run.best.map(|b| b.ssim), 4),
            number(run.best.map(|b| b.psnr), 2),
            run.best_step.map_or_else(|| "-".into(), |step| step.to_string()),
        ]
    };
    let header = ["run", "steps", "loss", "SSIM", "PSNR dB", "at step"];
    table(&header, &summaries.iter().map(cells).collect::<Vec<_>>(), Style::Text)
}
