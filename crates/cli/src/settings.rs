//! Settings: the defaults, then the site's tables, then flags. Unknown keys are errors.

use crate::cmd::plan::PolicyName;
use crate::exit::{Exit, OrBadInput};
use anyhow::{Context, anyhow};
use pipeline::Config;
use serde::de::DeserializeOwned;

/// The settings of a site.
pub fn of_site(
    site: &io::site::Site,
    policy: Option<PolicyName>,
    plans: Option<u32>,
) -> Result<Config, Exit> {
    let spec = &site.spec;
    let mut planning = spec.plan.clone();
    let uncertainty = match planning.remove("uncertainty") {
        Some(toml::Value::Table(inner)) => table(&inner, "plan.uncertainty")?,
        Some(_) => {
            return Err(Exit::bad_input(anyhow!(
                "site.toml, [plan]: uncertainty is a table, [plan.uncertainty]"
            )));
        }
        None => Default::default(),
    };
    let mut config = Config {
        segment: table(&spec.segment, "segment")?,
        pose: table(&spec.pose, "pose")?,
        plan: table(&planning, "plan")?,
        uncertainty,
        ..Config::default()
    };
    if let Some(policy) = policy {
        config.plan.policy = policy.policy();
    }
    if let Some(plans) = plans {
        config.uncertainty.seeds = plans;
    }
    Ok(config)
}

fn table<T: DeserializeOwned>(table: &toml::Table, name: &str) -> Result<T, Exit> {
    toml::Value::Table(table.clone())
        .try_into()
        .with_context(|| format!("site.toml, [{name}]"))
        .or_bad_input()
}
