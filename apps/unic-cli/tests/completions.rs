//! Contract: completion scripts and help texts cover every command and option.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{
    io::Write,
    path::Path,
    process::{Command, Stdio},
};

const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];
const COMMANDS: [&str; 10] = [
    "simulate",
    "import",
    "train",
    "eval",
    "animate",
    "inspect",
    "export",
    "retarget",
    "motion-database",
    "completions",
];

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Long options of a command, as its help lists them.
fn options(command: &str) -> Vec<String> {
    let help = succeeds(here(), &format!("{command} --help"));
    let option = |line: &str| {
        let words = line.trim_start().split([' ', ',', '=']);
        words
            .take(3)
            .find(|word| word.starts_with("--"))
            .map(str::to_owned)
    };
    let listed = help
        .lines()
        .filter(|line| line.starts_with("  "))
        .filter(|line| line.trim_start().starts_with('-'));
    listed.filter_map(option).collect()
}

#[test]
fn every_shell_completes_every_option_of_every_command() {
    for shell in SHELLS {
        let script = succeeds(here(), &format!("completions {shell}"));
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
            for option in options(command) {
                // fish and PowerShell have their own ways to write two dashes.
                let name = option.trim_start_matches('-');
                assert!(script.contains(name), "{shell}: {command} {option}");
            }
        }
    }
}

#[test]
fn help_lists_the_commands_and_their_options() {
    let help = succeeds(here(), "--help");
    for command in COMMANDS {
        assert!(help.contains(&format!("\n  {command} ")), "{command}");
        assert!(options(command).contains(&"--help".to_owned()), "{command}");
    }
    let animate = options("animate");
    for option in ["--motion", "--out", "--overwrite", "--frames", "--json"] {
        assert!(animate.contains(&option.to_owned()), "{option} in {animate:?}");
    }
}

/// Shells parse their scripts without running them. Shells that are not installed are skipped.
#[test]
fn every_installed_shell_parses_its_script() {
    for (shell, check) in [("bash", "-n"), ("zsh", "-n"), ("fish", "--no-execute")] {
        let child = Command::new(shell)
            .arg(check)
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let Ok(mut child) = child else {
            eprintln!("skipped: no {shell}");
            continue;
        };
        let script = succeeds(here(), &format!("completions {shell}"));
        child.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(
            output.status.success(),
            "{shell}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
