//! What users are handed: an archive a system, a Debian package, the list of components, notes and checksums.
//!
//! In: the version, the targets, the profile. Out: `tsumu-VERSION/` in the build folder. Archives hold the program, manual pages,
//! completions, licences and the change log, with the commit's time and no names of this machine.

use crate::check::built;
use crate::deb;
use crate::process::{cargo, command, done, output};
use crate::root;
use anyhow::{Context, Result, bail};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use zip::write::SimpleFileOptions;

/// Completions by shell, and where a system looks for them.
const COMPLETIONS: [(&str, &str); 4] = [
    ("bash", "tsumu.bash"),
    ("zsh", "_tsumu"),
    ("fish", "tsumu.fish"),
    ("powershell", "tsumu.ps1"),
];
const PAGES: [&str; 5] =
    ["README.md", "README.ja.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"];

/// Which program for whom.
pub struct Wanted<'a> {
    pub version: &'a str,
    pub profile: &'a str,
    /// Targets besides the machine's own.
    pub targets: Vec<&'a str>,
}

/// Flags of `cargo xtask package`: `[--profile P] [TARGET...]`.
pub fn package(args: &[&str], version: &str) -> Result<()> {
    let (profile, targets) = match args {
        ["--profile", profile, targets @ ..] => (*profile, targets),
        targets => ("dist", targets),
    };
    if let Some(flag) = targets.iter().find(|t| t.starts_with('-')) {
        bail!("there is no `{flag}`; `package [--profile P] [TARGET...]`");
    }
    let folder = pack(&Wanted { version, profile, targets: targets.to_vec() })?;
    println!("{}", folder.display());
    Ok(())
}

/// Builds and packs everything; the folder comes back.
pub fn pack(wanted: &Wanted) -> Result<PathBuf> {
    let folder = built().join(format!("tsumu-{}", wanted.version));
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let host = host()?;
    let own = build(wanted, None)?;
    // The pages that the program writes of itself are the same for every system.
    let texts = texts(&own, &folder.join("texts"))?;
    archive(wanted, &host, &own, &texts, &folder)?;
    if host.contains("linux") {
        deb::build(wanted.version, &own, &texts, &folder)?;
    }
    for target in &wanted.targets {
        let program = build(wanted, Some(target))?;
        archive(wanted, target, &program, &texts, &folder)?;
    }
    fs::remove_dir_all(&texts)?;
    let components = output(command("python3", ["tools/sbom.py"]))?;
    fs::write(folder.join("tsumu.cdx.json"), components)?;
    fs::write(folder.join("RELEASE_NOTES.md"), notes(wanted.version)?)?;
    sums(&folder)?;
    Ok(folder)
}

pub fn host() -> Result<String> {
    let said = output(command("rustc", ["-vV"]))?;
    let line = said.lines().find_map(|l| l.strip_prefix("host: "));
    Ok(line.context("rustc does not name its host")?.to_string())
}

/// The program for a target, built.
fn build(wanted: &Wanted, target: Option<&str>) -> Result<PathBuf> {
    let mut args =
        vec!["build", "--profile", wanted.profile, "--locked", "-p", "tsumu-cli", "--bin", "tsumu"];
    args.extend(target.iter().flat_map(|t| ["--target", t]));
    let mut cargo = cargo(&args);
    let mut flags = reproducibly(&mut cargo, &root(), &built())?;
    if target.is_some_and(|t| t.ends_with("windows-gnu")) {
        // mimalloc stamps its build; a warning in this compiler.
        flags.c.push("-Wno-error=date-time".into());
        cargo.env("CFLAGS_x86_64_pc_windows_gnu", flags.c.join(" "));
        // One file that needs no other: the compiler's own libraries go in.
        flags.rust.push("-Ctarget-feature=+crt-static".into());
        cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.rust.join(BETWEEN_FLAGS));
    }
    // Debian's names of the cross compiler; who has another says so in the environment.
    if target == Some("aarch64-unknown-linux-gnu") && !cfg!(target_arch = "aarch64") {
        let key = "CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER";
        if std::env::var_os(key).is_none() {
            cargo.env(key, "aarch64-linux-gnu-gcc");
        }
    }
    done(cargo)?;
    let windows = target.map_or(cfg!(windows), |t| t.contains("windows"));
    let folder = target.map_or(built(), |t| built().join(t)).join(wanted.profile);
    Ok(folder.join(if windows { "tsumu.exe" } else { "tsumu" }))
}

/// Flags of the compilers of a build.
#[derive(Default)]
pub struct Flags {
    rust: Vec<String>,
    c: Vec<String>,
}

/// What stands between flags that may hold blanks.
const BETWEEN_FLAGS: &str = "\u{1f}";

/// Has a build forget where and when it is made: no name of a folder of this machine goes into the program, and its parts in C
/// bear the commit's time. The same commit and compilers then give the same bytes (`cargo xtask reproducible`).
pub fn reproducibly(cargo: &mut Command, tree: &Path, target: &Path) -> Result<Flags> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| std::env::home_dir().map(|home| home.join(".cargo")));
    let named =
        [(Some(tree.to_path_buf()), "tsumu"), (Some(target.into()), "built"), (home, "cargo")];
    let mut flags = Flags::default();
    for (folder, name) in named {
        let Some(folder) = folder.and_then(|f| f.canonicalize().ok().or(Some(f))) else { continue };
        flags.rust.push(format!("--remap-path-prefix={}=/{name}", folder.display()));
        flags.c.push(format!("-ffile-prefix-map={}=/{name}", folder.display()));
    }
    // Of two that fit, the later counts: a build folder may lie in the tree.
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.rust.join(BETWEEN_FLAGS));
    if cfg!(unix) {
        cargo.env("CFLAGS", flags.c.join(" ")).env("CXXFLAGS", flags.c.join(" "));
    }
    cargo.env("CARGO_TARGET_DIR", target).env("CARGO_INCREMENTAL", "0");
    cargo.env("SOURCE_DATE_EPOCH", commit_time()?);
    Ok(flags)
}

/// Manual pages and completions, as the program writes them.
fn texts(program: &Path, folder: &Path) -> Result<PathBuf> {
    let man = folder.join("man").display().to_string();
    let program = program.display().to_string();
    done(command(&program, ["--quiet", "man", "--out", &man]))?;
    fs::create_dir_all(folder.join("completions"))?;
    for (shell, file) in COMPLETIONS {
        let script = output(command(&program, ["completions", shell]))?;
        fs::write(folder.join("completions").join(file), script)?;
    }
    Ok(folder.to_path_buf())
}

/// `tsumu-VERSION-TARGET.tar.gz`, for Windows a `.zip`.
fn archive(
    wanted: &Wanted,
    target: &str,
    program: &Path,
    texts: &Path,
    folder: &Path,
) -> Result<()> {
    let name = format!("tsumu-{}-{target}", wanted.version);
    let stage = folder.join(&name);
    fs::create_dir_all(&stage)?;
    fs::copy(program, stage.join(program.file_name().context("a program has a name")?))?;
    for page in PAGES {
        fs::copy(root().join(page), stage.join(page)).with_context(|| page.to_string())?;
    }
    copy_folder(texts, &stage)?;
    if target.contains("windows") {
        zipped(folder, &name)?;
    } else {
        let time = format!("--mtime=@{}", commit_time()?);
        let mut tar = command("tar", ["--sort=name", "--owner=0", "--group=0", "--numeric-owner"]);
        tar.arg(time).arg("-czf").arg(format!("{name}.tar.gz")).arg(&name);
        tar.env("GZIP", "-n").current_dir(folder);
        done(tar)?;
    }
    Ok(fs::remove_dir_all(&stage)?)
}

fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let place = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            fs::create_dir_all(&place)?;
            copy_folder(&entry.path(), &place)?;
        } else {
            fs::copy(entry.path(), place)?;
        }
    }
    Ok(())
}

/// Seconds since 1970 of the commit: archives of one commit are the same whenever they are made.
fn commit_time() -> Result<String> {
    Ok(output(command("git", ["log", "-1", "--format=%ct"]))?.trim().to_string())
}

fn zipped(folder: &Path, name: &str) -> Result<()> {
    let file = fs::File::create(folder.join(format!("{name}.zip")))?;
    let mut zip = zip::ZipWriter::new(file);
    let mut open = vec![folder.join(name)];
    let mut files = Vec::new();
    while let Some(here) = open.pop() {
        for entry in fs::read_dir(here)? {
            let path = entry?.path();
            if path.is_dir() { open.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    for path in files {
        let inside = path.strip_prefix(folder)?.to_string_lossy().replace('\\', "/");
        let program = inside.ends_with(".exe");
        let options =
            SimpleFileOptions::default().unix_permissions(if program { 0o755 } else { 0o644 });
        zip.start_file(inside, options)?;
        zip.write_all(&fs::read(&path)?)?;
    }
    zip.finish()?;
    Ok(())
}

/// The version's section of the change log; before it is dated, what is unreleased.
fn notes(version: &str) -> Result<String> {
    let changes = fs::read_to_string(root().join("CHANGELOG.md"))?;
    let section = section(&changes, &format!("## {version} ("))
        .or_else(|| section(&changes, "## Unreleased"))
        .context("CHANGELOG.md has no section for this version")?;
    Ok(format!("# Tsumu {version}\n\n{}\n", section.trim()))
}

/// What stands between a heading and the next of its rank.
fn section(text: &str, heading: &str) -> Option<String> {
    let mut lines = text.lines().skip_while(|l| !l.starts_with(heading));
    lines.next()?;
    Some(lines.take_while(|l| !l.starts_with("## ")).collect::<Vec<_>>().join("\n"))
}

fn sums(folder: &Path) -> Result<()> {
    let mut names: Vec<String> = fs::read_dir(folder)?
        .map(|e| Ok(e?.file_name().to_string_lossy().into_owned()))
        .collect::<Result<_>>()?;
    names.sort();
    let mut sum = command("sha256sum", &names);
    sum.current_dir(folder);
    Ok(fs::write(folder.join("SHA256SUMS"), output(sum)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_where_the_next_begins() {
        let text = "# C\n## Unreleased\n### Added\n- a\n## 0.1.0 (2026-01-01)\n- b\n";
        assert_eq!(section(text, "## Unreleased").unwrap(), "### Added\n- a");
        assert_eq!(section(text, "## 0.1.0 (").unwrap(), "- b");
        assert!(section(text, "## 0.2.0 (").is_none());
    }

    #[test]
    fn every_page_of_an_archive_is_there() {
        for page in PAGES {
            assert!(root().join(page).is_file(), "{page}");
        }
    }
}
