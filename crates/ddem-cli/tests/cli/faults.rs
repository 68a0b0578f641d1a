//! Tests of runs that the system disturbs: full disks, lost folders, other runs, clocks, damaged files.

use std::fs::File;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

use super::harness::*;
use super::kills::{FILES, check, column, compare};

/// Waits until a file exists while the run goes on.
fn wait_for(desk: &Desk, file: &str, child: &mut Child) {
    while !desk.path(file).exists() {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Status and messages of a run that must end by itself.
fn end(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn model_beyond_the_memory_is_refused_before_the_run() {
    let desk = Desk::with(&[SHAKE]);
    let text = String::from_utf8(desk.read("column.toml")).unwrap();
    desk.write("huge.toml", &text.replace("[1, 1, 3]", "[400, 400, 400]"));
    let outcome = desk.run("huge.toml --out out");
    assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
    let (message, _) = outcome.stderr.split_once(" [out-of-memory]").unwrap();
    assert!(message.starts_with("error: the model needs about "), "{message}");
    assert!(message.ends_with(": use fewer blocks or divisions"), "{message}");
    assert!(!desk.path("out").exists());
}

/// The limit of the size of files stands for a full disk. With any limit the files of results open, and once there is
/// room the run ends with the bits of one that always had it.
#[test]
#[cfg(unix)]
fn run_continues_after_a_full_disk() {
    let desk = column(&[PRESS, SHAKE]);
    let line = "column.toml --out cut --threads 1 --quiet --resume --checkpoint-every 0.05";
    let whole = desk.run("column.toml --out whole --threads 1");
    assert_eq!(whole.status, Some(0), "{}", whole.stderr);
    let largest = |name: &&str| desk.read(&format!("whole/{name}")).len();
    // In blocks of 512 bytes.
    let size = FILES.iter().map(largest).max().unwrap() / 512;
    for part in [1, 3, 5, 7] {
        let limit = size * part / 8;
        // A write beyond the limit then returns an error instead of ending the program.
        let script = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.current_dir(desk.path("")).args(["-c", &script, env!("CARGO_BIN_EXE_ddem")]);
        let child = command.args(line.split_whitespace()).stderr(Stdio::piped()).spawn().unwrap();
        let (status, message) = end(child);
        assert!(matches!(status, Some(1 | 2)), "{limit}: {status:?}, {message}");
        assert!(message.trim_end().ends_with("[file-access]"), "{limit}: {message}");
        assert!(message.contains("File too large"), "{limit}: {message}");
        check(&desk.path("cut"));
        compare(&desk, line);
        std::fs::remove_dir_all(desk.path("cut")).unwrap();
    }
}

/// Without a shell that ignores it, the signal of the limit would end the run without a word.
#[test]
#[cfg(unix)]
fn limit_of_the_size_of_files_ends_a_run_with_a_message() {
    let desk = column(&[PRESS, SHAKE]);
    let mut command = Command::new("sh");
    command.current_dir(desk.path("")).args(["-c", "ulimit -f 32; exec \"$0\" \"$@\""]);
    command.args([env!("CARGO_BIN_EXE_ddem"), "column.toml", "--out", "a", "--quiet"]);
    let (status, message) = end(command.stderr(Stdio::piped()).spawn().unwrap());
    assert_eq!(status, Some(1), "{message}");
    assert!(message.contains("File too large"), "{message}");
    let advice = ": raise the limit on the size of files (`ulimit -f`) [file-access]";
    assert!(message.trim_end().ends_with(advice), "{message}");
}

/// A pipe without a writer waits for ever, and `/dev/zero` has no end: both are refused at once, as decks and as files
/// that a deck names. What a shell pipes to `/dev/stdin` is a deck.
#[test]
#[cfg(unix)]
fn pipes_and_devices_are_refused() {
    use std::io::Write;
    let desk = Desk::with(&[PRESS]);
    let made = Command::new("mkfifo").arg(desk.path("pipe.stl")).status().unwrap();
    assert!(made.success());
    let region = |file: &str| {
        format!(
            "[materials.rock]\ndensity = 2400\nyoung = 18e9\npoisson = 0.25\n[[region]]\nfile = '{file}'\n\
             material = 'rock'\n[[stage]]\nname = 'a'\nkind = 'relax'\n"
        )
    };
    desk.write("pipe.toml", &region("pipe.stl"));
    std::os::unix::fs::symlink("/dev/zero", desk.path("zero.stl")).unwrap();
    desk.write("zero.toml", &region("zero.stl"));
    let mut found = String::new();
    for deck in ["pipe.stl", "/dev/zero", "pipe.toml", "zero.toml"] {
        let outcome = desk.run(&format!("{deck} --check"));
        assert_eq!(outcome.status, Some(2), "{deck}");
        found += &outcome.stderr;
    }
    insta::assert_snapshot!(found);
    let mut command = desk.command("/dev/stdin --check --quiet");
    let mut child = command.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(&desk.read("column.toml")).unwrap();
    assert_eq!(end(child), (Some(0), String::new()));
}

/// A kill between two system calls leaves a file of the check whether the folder can be written to.
#[test]
fn remains_of_a_killed_start_are_removed() {
    let desk = Desk::with(&[PRESS]);
    std::fs::create_dir(desk.path("a")).unwrap();
    desk.write("a/.ddem.part", "");
    assert_eq!(desk.run("column.toml --out a --quiet").status, Some(0));
    assert!(!desk.path("a/.ddem.part").exists());
}

/// A folder that nobody may write to, one in it, and one below a file are refused before anything is
/// written. Permissions do not hold for root, whose run is therefore that of another user.
#[test]
#[cfg(unix)]
fn read_only_folders_are_refused_before_the_run() {
    use std::fs::{Permissions, create_dir, metadata, read_dir, set_permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;

    const NOBODY: u32 = 65534;
    let desk = Desk::with(&[PRESS]);
    create_dir(desk.path("locked")).unwrap();
    let root = metadata(desk.path("locked")).unwrap().uid() == 0;
    let run = |out: &str| {
        let mut command = desk.command(&format!("column.toml --quiet --out {out}"));
        if root {
            command.uid(NOBODY).gid(NOBODY);
        }
        command.stderr(Stdio::piped()).spawn().map(end)
    };
    set_permissions(desk.path(""), Permissions::from_mode(0o755)).unwrap();
    set_permissions(desk.path("locked"), Permissions::from_mode(0o555)).unwrap();
    let mut messages = String::new();
    for out in ["locked", "locked/run", "column.toml/run"] {
        let (status, message) = match run(out) {
            // Programs in the home folder of root.
            Err(error) if root && error.kind() == std::io::ErrorKind::PermissionDenied => {
                println!("skipped: nobody but root may start {}", env!("CARGO_BIN_EXE_ddem"));
                return;
            }
            ended => ended.unwrap(),
        };
        assert_eq!(status, Some(2), "{message}");
        messages += &message;
    }
    assert_eq!(read_dir(desk.path("locked")).unwrap().count(), 0);
    set_permissions(desk.path("locked"), Permissions::from_mode(0o755)).unwrap();
    insta::assert_snapshot!(messages);
}

/// The message names a file in the folder that is gone.
#[test]
fn removed_folder_ends_the_run_with_a_message() {
    let desk = Desk::with(&[&LONG_SHAKE.replace("frames = 5", "frames = 5000")]);
    let child = desk.command("column.toml --quiet --out a").stderr(Stdio::piped()).spawn();
    let mut child = child.unwrap();
    wait_for(&desk, "a/energy.csv", &mut child);
    // The run may write a file meanwhile.
    while std::fs::remove_dir_all(desk.path("a")).is_err() {}
    let (status, message) = end(child);
    assert_eq!(status, Some(1), "{message}");
    assert!(message.starts_with("error: ") && message.contains("a/"), "{message}");
    let advice = ": the file or its folder is not there: make the folder, and leave both in their place during a run \
                  [file-access]";
    assert!(message.trim_end().ends_with(advice), "{message}");
}

/// A run that writes nothing for long notices soon that its folder has another name. The results are all there.
#[test]
fn renamed_folder_ends_the_run_soon() {
    let desk = Desk::with(&[&LONG_SHAKE.replace("duration = 4.0", "duration = 4000.0")]);
    let line = "column.toml --out a --checkpoint-every 3600";
    let mut child = desk.command(line).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&desk, "a/status.json", &mut child);
    while std::fs::rename(desk.path("a"), desk.path("b")).is_err() {}
    let (status, message) = end(child);
    assert_eq!(status, Some(1), "{message}");
    let last = message.lines().last().unwrap();
    let advice = ": the file or its folder is not there: make the folder, and leave both in their place during a run \
                  [file-access]";
    assert!(last.starts_with("error: writing a/") && last.ends_with(advice), "{message}");
    assert!(!message.contains("the results up to here"), "{message}");
    assert_eq!(desk.names(), ["b", "column.toml"]);
    check(&desk.path("b"));
}

/// One of four runs that start at once gets the folder; the others change nothing in it.
#[test]
#[cfg(unix)]
fn one_of_several_runs_gets_the_folder() {
    let desk = Desk::with(&[LONG_SHAKE]);
    let start = |_| {
        let mut command = desk.command("column.toml --quiet --out a");
        command.stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut runs: Vec<Child> = (0..4).map(start).collect();
    let begun = Instant::now();
    while runs.iter_mut().filter_map(|run| run.try_wait().unwrap()).count() < 3 {
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
    let mut interrupted = 0;
    for mut run in runs {
        if run.try_wait().unwrap().is_none() {
            wait_for(&desk, "a/energy.csv", &mut run);
            let kill = Command::new("kill").args(["-TERM", &run.id().to_string()]).status();
            assert!(kill.unwrap().success());
            interrupted += 1;
            assert_eq!(end(run), (Some(130), String::new()));
        } else {
            let (status, message) = end(run);
            let expected = "error: another run is writing to a: wait until it has finished or give \
                            another --out [results-folder]\n";
            assert_eq!((status, message.as_str()), (Some(2), expected));
        }
    }
    assert_eq!(interrupted, 1);
    assert!(desk.path("a/checkpoint.h5").exists());
    assert_eq!(desk.names(), ["a", "column.toml"]);
}

/// Files from a year ahead and from 1970, as after a jump of the clock.
#[test]
fn files_may_have_any_time() {
    let desk = column(&[PRESS, SHAKE]);
    assert_eq!(desk.run("column.toml --out whole").status, Some(0));
    assert_eq!(desk.run("column.toml --out cut").status, Some(0));
    let ahead = SystemTime::now() + Duration::from_secs(365 * 86_400);
    for (time, age) in [(ahead, "0.0 s"), (SystemTime::UNIX_EPOCH, " ")] {
        for entry in std::fs::read_dir(desk.path("cut")).unwrap() {
            let file = File::options().append(true).open(entry.unwrap().path()).unwrap();
            file.set_modified(time).unwrap();
        }
        let status = desk.run("status cut");
        assert_eq!(status.status, Some(0), "{}", status.stderr);
        assert!(status.stdout.contains(age), "{}", status.stdout);
        compare(&desk, "column.toml --out cut --resume");
    }
}

/// Flips a bit in many places of each file of results, or cuts the file there. A run that resumes either ends or says
/// which file is wrong; it neither crashes nor hangs.
#[test]
fn damaged_results_are_refused_or_mended() {
    damage(6);
}

#[test]
#[ignore = "takes minutes"]
fn much_damaged_results_are_refused_or_mended() {
    damage(500);
}

fn damage(places: usize) {
    let desk = column(&[PRESS, SHAKE]);
    let line = "column.toml --out cut --threads 1 --quiet";
    assert_eq!(desk.run(line).status, Some(0));
    let resume = format!("{line} --resume");
    let mut refused = 0;
    for name in FILES.iter().chain(&["probes.csv", "ddem.json"]) {
        let name = format!("cut/{name}");
        let whole = desk.read(&name);
        for place in 0..places {
            // The first bytes are those that describe the file.
            let at = if place % 2 == 0 { whole.len() * place / places } else { 97 * place + 8 };
            let at = at.min(whole.len() - 1);
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << (place % 8);
            for bytes in [&flipped[..], &whole[..at]] {
                std::fs::write(desk.path(&name), bytes).unwrap();
                let run = desk.run(&resume);
                let message = &run.stderr;
                assert!(matches!(run.status, Some(0..=2)), "{name}, {at}: {run:?}");
                assert_eq!(run.status == Some(0), message.is_empty(), "{name}, {at}: {message}");
                assert!(!message.contains("panicked"), "{name}, {at}: {message}");
                refused += usize::from(run.status != Some(0));
            }
        }
        std::fs::write(desk.path(&name), whole).unwrap();
        assert_eq!(desk.run(&resume).status, Some(0));
    }
    println!("{refused} of {} damaged files were refused", 2 * 5 * places);
    assert!(refused > 0);
}
