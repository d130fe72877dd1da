//! `vocc plan`: which effects a scene calls for.

use sim::plan::Plan;
use sim::view::View;

use crate::options::Shared;
use crate::output::{self, Answer};

/// Arguments of `vocc plan`.
#[derive(clap::Args)]
pub struct Arguments {
    /// A preset or a TOML file.
    #[arg(default_value = "paper")]
    scene: String,
}

/// Prints the plan.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let plan = Plan::of(&View::new(&shared.scene(&arguments.scene)?)?);
    if shared.json {
        plan.decisions.iter().try_for_each(output::json)?;
    } else {
        output::plan(&plan)?;
    }
    Ok(Answer::Yes)
}
