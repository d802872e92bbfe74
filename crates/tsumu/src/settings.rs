//! Settings: the method's defaults, then the site's tables, then a settings file, then what the call says. One language for
//! all of them, [`Config`]: a run's `config.toml` given back as a settings file repeats the run.

use crate::error::OrBadInput;
use crate::{Error, Result};
use anyhow::{Context, anyhow};
use pipeline::{Config, Method};
use plan::Policy;
use scene::{MemoryBound, SiteSpec};
use std::path::{Path, PathBuf};

/// What a caller says beside the site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Whose values stand where neither site nor file says another; `None`: the file's `method`, or ours.
    pub method: Option<Method>,
    /// A TOML file whose tables count before the site's.
    pub file: Option<PathBuf>,
    /// Tables that count before the file's, in the same language.
    pub tables: toml::Table,
    /// Where the planner's first poses come from.
    pub policy: Option<Policy>,
    /// Drops of policy `random` in a window, of which the best stays.
    pub drops: Option<u32>,
    /// How many plans the range of the count is taken from; 0: no range.
    pub plans: Option<u32>,
    /// Trials a block in which a plan is improved.
    pub improve: Option<f32>,
    /// Root of all random choices; `None`: the site's.
    pub seed: Option<u64>,
    /// How much memory may be taken; `None`: what the site says, else as much as it needs.
    pub memory: Option<MemoryBound>,
}

impl Settings {
    /// Settings from JSON text of the same tables: `{"plan": {"rounds": 3}}`. Error: it is no such text.
    pub fn of_json(text: &str) -> Result<Self> {
        let tables = serde_json::from_str(text).context("settings").or_bad_input()?;
        Ok(Self { tables, ..Self::default() })
    }

    /// The settings of a loose cloud.
    pub(crate) fn alone(&self) -> Result<Config> {
        self.over(toml::Table::new())
    }

    /// The settings of a site.
    pub(crate) fn of_site(&self, spec: &SiteSpec) -> Result<Config> {
        let mut tables = toml::Table::new();
        for (name, table) in spec.settings().into_iter().filter(|(_, t)| !t.is_empty()) {
            // Read alone first, so that a message names the file.
            one_table(name, table).context("site.toml").or_bad_input()?;
            tables.insert(name.into(), toml::Value::Table(table.clone()));
        }
        self.over(tables)
    }

    fn over(&self, mut tables: toml::Table) -> Result<Config> {
        if let Some(file) = &self.file {
            let own: toml::Table = io::site::read_toml(file).or_bad_input()?;
            // Unknown keys are named with their line.
            let _: Config = io::site::read_toml(file).or_bad_input()?;
            lay(&mut tables, own);
        }
        if !self.tables.is_empty() {
            let own = toml::Value::Table(self.tables.clone());
            // Read alone first, so that a message says where an unknown key stands.
            let _: Config = own.try_into().context("settings").or_bad_input()?;
            lay(&mut tables, self.tables.clone());
        }
        let said: Config = toml::Value::Table(tables.clone()).try_into().or_bad_input()?;
        let method = self.method.unwrap_or(said.method);
        let mut under = toml::Table::try_from(Config::of(method)).or_bad_input()?;
        lay(&mut under, tables);
        let mut config: Config = toml::Value::Table(under).try_into().or_bad_input()?;
        config.method = method;
        if let Some(policy) = self.policy {
            config.plan.policy = policy;
        }
        if let Some(improve) = self.improve {
            config.plan.search.improve = improve;
        }
        if let Some(drops) = self.drops {
            if config.plan.policy != Policy::Random || drops == 0 {
                return Err(Error::bad_input(anyhow!(
                    "--drops {drops}: give at least 1, with policy `random` (--policy random or --method thesis)"
                )));
            }
            config.plan.random.drops = drops;
        }
        if let Some(plans) = self.plans {
            config.plan.uncertainty.seeds = plans;
        }
        Ok(config)
    }
}

/// What of a method does not stand because site, file or flags say otherwise, as `key = value`.
pub(crate) fn departures(config: &Config) -> Result<Vec<String>> {
    let tables = |c: &Config| toml::Table::try_from(c).or_bad_input();
    let (ours, method) = (tables(&Config::default())?, tables(&Config::of(config.method))?);
    let mut out = Vec::new();
    differing("", &ours, &method, &tables(config)?, &mut out);
    Ok(out)
}

/// Keys in which a method differs from ours, and `config` from the method.
fn differing(
    above: &str,
    ours: &toml::Table,
    method: &toml::Table,
    config: &toml::Table,
    out: &mut Vec<String>,
) {
    for (key, value) in method {
        let name = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        match (ours.get(key), value, config.get(key)) {
            (Some(toml::Value::Table(o)), toml::Value::Table(m), Some(toml::Value::Table(c))) => {
                differing(&name, o, m, c, out);
            }
            (o, m, Some(c)) if o != Some(m) && m != c => out.push(format!("{name} = {c}")),
            _ => {}
        }
    }
}

/// Checks one table of a site.
fn one_table(name: &str, table: &toml::Table) -> anyhow::Result<()> {
    if name == "plan" && table.get("uncertainty").is_some_and(|u| !u.is_table()) {
        return Err(anyhow!("[plan]: uncertainty is a table, [plan.uncertainty]"));
    }
    let alone = toml::Table::from_iter([(name.to_string(), toml::Value::Table(table.clone()))]);
    let _: Config = toml::Value::Table(alone).try_into().with_context(|| format!("[{name}]"))?;
    Ok(())
}

/// Lays a table over another: tables are joined, everything else is replaced.
fn lay(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(there)), toml::Value::Table(more)) => lay(there, more),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

/// A run's settings as its `config.toml` has them.
pub(crate) fn read(file: &Path) -> Result<Config> {
    io::site::read_toml(file).map_err(Error::bad_input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(tables: &str) -> SiteSpec {
        toml::from_str(&format!("name = \"t\"\n{tables}")).unwrap()
    }

    #[test]
    fn the_site_speaks_the_language_of_the_settings() {
        let spec = spec(
            "[background]\nbin = false\n[plan]\nrounds = 3\n[plan.uncertainty]\nseeds = 2\n[bed]\npoints = 4\n",
        );
        let config = Settings::default().of_site(&spec).unwrap();
        assert!(!config.background.bin);
        assert_eq!((config.plan.rounds, config.plan.uncertainty.seeds), (3, 2));
        assert_eq!(config.bed.points, 4);
    }

    #[test]
    fn what_is_written_comes_back() {
        let spec = spec("[plan]\nrounds = 3\n[plan.random]\ndrops = 2\n[pose]\nrounds = 2\n");
        let config = Settings::default().of_site(&spec).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        std::fs::write(&file, toml::to_string(&config).unwrap()).unwrap();
        assert_eq!(read(&file).unwrap(), config);
        let again = Settings { file: Some(file.clone()), ..Settings::default() };
        assert_eq!(again.of_site(&spec).unwrap(), config);
        assert_eq!(again.alone().unwrap(), config);
        // A file that says a part leaves the rest to the site.
        std::fs::write(&file, "[plan]\nwalls = true\n").unwrap();
        let both = again.of_site(&spec).unwrap();
        assert!(both.plan.walls && both.plan.rounds == 3 && both.pose.rounds == 2);
    }

    #[test]
    fn settings_may_come_as_json() {
        let own = Settings::of_json(r#"{"plan": {"rounds": 3}}"#).unwrap();
        let config = own.of_site(&spec("[plan]\nrounds = 2\nwalls = true\n")).unwrap();
        assert!(config.plan.walls && config.plan.rounds == 3);
        let line = |text: &str| Settings::of_json(text).and_then(|s| s.alone()).unwrap_err().line();
        assert!(line(r#"{"plan": {"speed": 3}}"#).contains("speed"));
        assert!(line("[1]").contains("settings"));
    }

    #[test]
    fn a_method_stands_under_what_site_and_file_say() {
        let thesis = Settings { method: Some(Method::Thesis), ..Settings::default() };
        let plain = thesis.of_site(&spec("")).unwrap();
        assert_eq!(plain, Config::of(Method::Thesis));
        assert_ne!(plain.segment, Config::default().segment);
        assert!(departures(&plain).unwrap().is_empty());
        let own = thesis
            .of_site(&spec(
                "[plan]\nrounds = 3\npolicy = \"search\"\n[segment]\nsuppression = 0.8\n",
            ))
            .unwrap();
        assert_eq!((own.plan.rounds, own.segment.suppression), (3, 0.8));
        assert_eq!(own.pose, plain.pose);
        assert_eq!(departures(&own).unwrap(), ["plan.policy = \"search\""]);
        // What is recorded repeats it without the word.
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        std::fs::write(&file, toml::to_string(&own).unwrap()).unwrap();
        let again = Settings { file: Some(file), ..Settings::default() };
        assert_eq!(again.alone().unwrap(), own);
    }

    #[test]
    fn drops_are_of_random_drops() {
        let many = |policy| Settings { drops: Some(9), policy, ..Settings::default() };
        assert_eq!(many(Some(Policy::Random)).alone().unwrap().plan.random.drops, 9);
        assert!(many(None).alone().unwrap_err().line().contains("--drops 9"));
        let thesis = Settings { method: Some(Method::Thesis), ..many(None) };
        assert_eq!(thesis.alone().unwrap().plan.random.drops, 9);
    }

    #[test]
    fn what_is_unknown_is_named() {
        let line = |tables: &str| Settings::default().of_site(&spec(tables)).unwrap_err().line();
        let said = line("[plan]\nspeed = 3\n");
        assert!(said.contains("site.toml") && said.contains("[plan]") && said.contains("speed"));
        assert!(line("[plan]\nuncertainty = 3\n").contains("[plan.uncertainty]"));
    }
}
