//! Small and read-only disks: a tmpfs in a mount namespace, which ends with the command.

use super::{files, fs};
use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Output},
    sync::LazyLock,
};

/// Permission to mount file systems in a test.
pub(crate) struct Disk;

/// Result of a command that ran with a disk.
pub(crate) struct Left {
    pub(crate) output: Output,
    /// Files on the disk at the end, by their paths.
    pub(crate) files: BTreeMap<String, Vec<u8>>,
}

/// Script that mounts the disk and runs a program.
///
/// Its arguments are the mount options, the remount options, the program and its arguments. The
/// disk begins as a copy of the folder `seed` and is copied to the folder `left` at the end.
const SCRIPT: &str = r#"
mount -t tmpfs -o "$1" none disk && cp -r seed/. disk/ && { [ -z "$2" ] || mount -o "$2" disk; } || exit 77
shift 2
"$@"
code=$?
cp -r disk/. left/ || exit 77
exit $code
"#;

impl Disk {
    /// Returns `None`, and prints a line, if nothing can be mounted here.
    pub(crate) fn new() -> Option<Self> {
        static CAN_MOUNT: LazyLock<bool> = LazyLock::new(|| {
            let mount = "mount -t tmpfs -o size=64k none /tmp";
            let tried = Command::new("unshare").args(["-rm", "sh", "-c", mount]).output();
            tried.is_ok_and(|output| output.status.success())
        });
        if !*CAN_MOUNT {
            eprintln!("skipped: no file system can be mounted here");
        }
        CAN_MOUNT.then_some(Self)
    }

    /// Makes the folder `seed` with copies of files: pairs of a new name and a file in `folder`.
    pub(crate) fn seed(&self, folder: &Path, names: &[(&str, &str)]) -> BTreeMap<String, Vec<u8>> {
        let seed = folder.join("seed");
        for made in [&seed, &folder.join("disk")] {
            fs::create_dir_all(made).unwrap();
        }
        for (name, from) in names {
            fs::copy(folder.join(from), seed.join(name)).unwrap();
        }
        files(&seed)
    }

    /// Runs the program in `folder` with a disk of `kilobytes` at `folder`/disk.
    pub(crate) fn run(&self, folder: &Path, kilobytes: u64, line: &str) -> Left {
        // A tmpfs of size zero has no limit.
        let mount_options = format!("size={}k", kilobytes.max(4));
        self.run_on(folder, &mount_options, "", line)
    }

    /// Runs the program in `folder` with a read-only disk at `folder`/disk.
    pub(crate) fn run_read_only(&self, folder: &Path, line: &str) -> Left {
        self.run_on(folder, "size=64m", "remount,ro", line)
    }

    fn run_on(&self, folder: &Path, mount_options: &str, remount_options: &str, line: &str) -> Left {
        let left = folder.join("left");
        let _ = fs::remove_dir_all(&left);
        fs::create_dir(&left).unwrap();
        let output = Command::new("unshare")
            .current_dir(folder)
            .args(["-rm", "sh", "-c", SCRIPT, "sh"])
            .args([mount_options, remount_options])
            .arg(env!("CARGO_BIN_EXE_unic"))
            .args(line.split_whitespace())
            .output()
            .unwrap();
        assert_ne!(output.status.code(), Some(77), "{}", super::stderr(&output));
        let files = files(&left);
        Left { output, files }
    }
}

impl Left {
    /// Copies the files to a folder of the ordinary disk.
    pub(crate) fn restore(&self, folder: &Path) {
        for (name, bytes) in &self.files {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
}
