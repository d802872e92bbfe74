//! The Debian package: program, manual pages, completions and an entry in the menu that opens the page.

use crate::process::{command, done};
use crate::root;
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;

const MENU: &str = "[Desktop Entry]
Type=Application
Name=Tsumu
Comment=Blocks of a breakwater: recognise them in a survey and plan the next layer
Comment[ja]=消波ブロックの認識と積み方計画
Exec=tsumu open %f
Terminal=true
Categories=Science;Engineering;
";

/// Writes `tsumu_VERSION_ARCH.deb` into `folder`, by `dpkg-deb`.
pub fn build(version: &str, program: &Path, texts: &Path, folder: &Path) -> Result<()> {
    let stage = folder.join("deb");
    let put = |from: &Path, to: &str| -> Result<()> {
        let place = stage.join(to);
        fs::create_dir_all(place.parent().context("below the stage")?)?;
        fs::copy(from, place).with_context(|| from.display().to_string())?;
        Ok(())
    };
    put(program, "usr/bin/tsumu")?;
    for page in fs::read_dir(texts.join("man"))? {
        let page = page?;
        let name = page.file_name().to_string_lossy().into_owned();
        put(&page.path(), &format!("usr/share/man/man1/{name}"))?;
        done(command(
            "gzip",
            ["-9n", &stage.join("usr/share/man/man1").join(name).display().to_string()],
        ))?;
    }
    for (file, place) in [
        ("tsumu.bash", "usr/share/bash-completion/completions/tsumu"),
        ("_tsumu", "usr/share/zsh/vendor-completions/_tsumu"),
        ("tsumu.fish", "usr/share/fish/vendor_completions.d/tsumu.fish"),
    ] {
        put(&texts.join("completions").join(file), place)?;
    }
    for page in ["README.md", "README.ja.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        put(&root().join(page), &format!("usr/share/doc/tsumu/{page}"))?;
    }
    fs::create_dir_all(stage.join("usr/share/applications"))?;
    fs::write(stage.join("usr/share/applications/tsumu.desktop"), MENU)?;
    fs::write(stage.join("usr/share/doc/tsumu/copyright"), copyright())?;
    fs::create_dir_all(stage.join("DEBIAN"))?;
    let bytes = fs::read(program)?;
    fs::write(stage.join("DEBIAN/control"), control(version, &bytes))?;
    let file = folder.join(format!("tsumu_{version}_{}.deb", arch()));
    let words = ["--root-owner-group", "--build"].map(String::from);
    let places = [stage.display().to_string(), file.display().to_string()];
    done(command("dpkg-deb", words.iter().chain(&places)))?;
    Ok(fs::remove_dir_all(&stage)?)
}

fn arch() -> &'static str {
    match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    }
}

fn control(version: &str, program: &[u8]) -> String {
    format!(
        "Package: tsumu\nVersion: {version}\nArchitecture: {}\nMaintainer: The Tsumu authors <tsumu@invalid>\nInstalled-Size: {}\nDepends: libc6 (>= {}), libgcc-s1\nRecommends: xdg-utils\nSection: science\nPriority: optional\nDescription: recognise the blocks of a breakwater and plan the next layer\n Reads surveys of a pile of armour units, finds every block with its position\n and attitude, and plans how many more to place, where and in which order.\n \"tsumu open\" does so in the browser.\n",
        arch(),
        program.len().div_ceil(1024),
        libc_needed(program),
    )
}

/// The newest symbol version of the C library that the program names.
fn libc_needed(program: &[u8]) -> String {
    const MARK: &[u8] = b"GLIBC_2.";
    let newest = program
        .windows(MARK.len() + 3)
        .filter(|w| w.starts_with(MARK))
        .filter_map(|w| {
            let digits: Vec<u8> =
                w[MARK.len()..].iter().copied().take_while(u8::is_ascii_digit).collect();
            String::from_utf8(digits).ok()?.parse::<u32>().ok()
        })
        .max();
    format!("2.{}", newest.unwrap_or(17))
}

fn copyright() -> String {
    "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: tsumu\n\nFiles: *\nCopyright: The Tsumu authors\nLicense: MIT or Apache-2.0\n The texts are LICENSE-MIT and LICENSE-APACHE in this folder; the list of\n components with their licences is tsumu.cdx.json of the release.\n".into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_package_asks_for_the_library_that_the_program_needs() {
        assert_eq!(libc_needed(b"..GLIBC_2.2.5\0GLIBC_2.34\0GLIBC_2.9\0.."), "2.34");
        assert_eq!(libc_needed(b"static"), "2.17");
        let text = control("0.2.0", b"GLIBC_2.34\0aaa");
        assert!(text.contains("Version: 0.2.0\n") && text.contains("libc6 (>= 2.34)"));
        assert!(text.lines().all(|l| l.starts_with(' ') || l.contains(": ")), "{text}");
    }
}
