//! The other end of a pipe: a program that is asked for samples and densities. The protocol is written down in `docs/protocol.md`.
//!
//! Every question is written whole before the answer is read, and is small enough for a pipe's buffer, so that neither side waits for the other for ever.
//! Several threads ask several copies of the program. A watch kills a copy that doesn't answer in time, which ends the read that waits for it.

use super::columns::DENSITY_IS_FIRST;
use crate::spelling::meant;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Why a program can't be asked any more.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// The command line has no words, or a quote that doesn't end.
    #[error("`{command}` is no command line")]
    Command {
        /// The command line.
        command: String,
    },
    /// The command line asks for what only a shell does.
    #[error("`{command}` has a bare `{word}`, but there is no shell between: `sh -c '…'` is one")]
    Shell {
        /// The command line.
        command: String,
        /// The word.
        word: String,
    },
    /// It doesn't start.
    #[error("can't start `{command}`: {why}")]
    Start {
        /// The command line.
        command: String,
        /// What the operating system says.
        why: String,
    },
    /// Its first line is not the one that the protocol asks for.
    #[error(
        "the first line of `{command}` should be like `warpcheck 1 domain=hemisphere dimensions=2`: {why}"
    )]
    Greeting {
        /// The command line.
        command: String,
        /// What is wrong.
        why: String,
    },
    /// It ended while it was asked something.
    #[error("`{command}` {how} {when}{last_words}")]
    Died {
        /// The command line.
        command: String,
        /// How it ended.
        how: String,
        /// What it was asked.
        when: String,
        /// What it wrote to standard error.
        last_words: String,
    },
    /// It took too long.
    #[error(
        "`{command}` gave no answer in {seconds} s {when}: is its output flushed? (--timeout gives it longer){last_words}"
    )]
    Hangs {
        /// The command line.
        command: String,
        /// The time it had.
        seconds: f64,
        /// What it was asked.
        when: String,
        /// What it wrote to standard error.
        last_words: String,
    },
    /// Its answer ends early.
    #[error("`{command}` wrote {bytes} of {of} bytes in {seconds} s {when}: {what}{last_words}")]
    Short {
        /// The command line.
        command: String,
        /// Bytes that it wrote.
        bytes: usize,
        /// Bytes of a whole answer.
        of: usize,
        /// The time it had.
        seconds: f64,
        /// What it was asked.
        when: String,
        /// What they may be.
        what: String,
        /// What it wrote to standard error.
        last_words: String,
    },
    /// Its numbers are none.
    #[error(
        "`{command}` answers nonsense {when}: {what}; does it print something else, or numbers that are not 64-bit little-endian?"
    )]
    Nonsense {
        /// The command line.
        command: String,
        /// What it was asked.
        when: String,
        /// What it said.
        what: String,
    },
    /// The same question has two answers.
    #[error(
        "`{command}` gives {first} for xi = {xi:?} and, asked again, {second}: it must use nothing but these variates"
    )]
    Forgetful {
        /// The command line.
        command: String,
        /// The variates.
        xi: Vec<f64>,
        /// The first answer.
        first: String,
        /// The second.
        second: String,
    },
    /// It wrote more than it was asked for.
    #[error("`{command}` wrote {}{bytes} bytes more than it was asked for{when}{what}", at_least(*.bytes))]
    TooMuch {
        /// The command line.
        command: String,
        /// How many.
        bytes: usize,
        /// What it was asked, if that is known.
        when: String,
        /// What they may be.
        what: String,
    },
    /// Its points are where its densities look as if they were.
    #[error("the answers of `{command}`: {} (an answer is the point, then its density)", DENSITY_IS_FIRST)]
    DensityFirst {
        /// The command line.
        command: String,
    },
}

fn at_least(bytes: usize) -> &'static str {
    if bytes as u64 >= BEYOND { "at least " } else { "" }
}

/// What an answer of so many bytes has in each of its rows, where it has as much in each.
fn widths(bytes: usize, of: usize, rows: usize) -> Option<String> {
    if rows == 0 || bytes == 0 || bytes == of || !bytes.is_multiple_of(rows) {
        return None;
    }
    let numbers = |n: usize| format!("{n} number{}", if n == 1 { "" } else { "s" });
    let (each, due) = (bytes / rows, of / rows / 8);
    let doubles = each.is_multiple_of(8).then_some(each / 8);
    let columns = match doubles {
        Some(n) if n + 1 == due => Some("a column missing"),
        Some(n) if n < due => Some("columns missing"),
        Some(n) if n == due + 1 => Some("a column too many"),
        Some(_) => Some("columns too many"),
        None => None,
    };
    let singles = each == 4 * due;
    let guesses: Vec<&str> = singles.then_some("f32 for f64").into_iter().chain(columns).collect();
    let words = doubles.map(numbers).into_iter().chain(singles.then(|| numbers(due) + " of 32 bits"));
    let words: Vec<String> = words.collect();
    let are = if due == 1 { "is" } else { "are" };
    (!words.is_empty())
        .then(|| format!("{} a row where {due} {are} due; {}?", words.join(" or "), guesses.join(", or ")))
}

fn only_answers(text: String) -> String {
    format!("`{text}`? Nothing but answers goes to standard output")
}

/// The longest text among bytes, if it is long enough to be no accident, or all of `extra` bytes at one of the ends.
fn text_among(bytes: &[u8], extra: usize) -> Option<String> {
    const NO_ACCIDENT: usize = 16;
    const QUOTED: usize = 60;
    let is_text = |b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    let runs = bytes.split(|b| !is_text(b));
    let longest = runs.max_by_key(|run| run.len()).filter(|run| run.len() >= NO_ACCIDENT);
    let ends = || {
        let (front, back) = (bytes.get(..extra)?, bytes.get(bytes.len() - extra..)?);
        [back, front].into_iter().find(|end| extra > 0 && end.iter().all(is_text))
    };
    let text = String::from_utf8_lossy(longest.or_else(ends)?).trim().to_owned();
    let line = text.lines().next().unwrap_or_default();
    let quoted: String = line.chars().take(QUOTED).collect();
    let more = if quoted.len() < text.len() { "…" } else { "" };
    Some(format!("{quoted}{more}"))
}

/// What a program says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Greeting {
    /// Words of the form `key=value`, in their order.
    pub words: Vec<(String, String)>,
}

impl Greeting {
    /// All keys that there are.
    pub const KEYS: [&str; 6] = ["domain", "dimensions", "frame", "measure", "grid", "density"];

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.words.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }
}

const GREETING_LIMIT: u64 = 4096;
const WORDS_KEPT: usize = 20;
/// Numbers of a question, at most: 32 KiB.
const NUMBERS: usize = 4096;
/// Questions in one request, at most.
pub(super) const REQUEST: usize = 1024;
/// What a shell would make a pipe, a sequence or a redirection of.
const SHELL: [&str; 10] = ["|", "||", "&&", "&", ";", "<", ">", ">>", "2>", "2>&1"];
/// Bytes beyond an answer that are counted, at most, and the time for them.
const BEYOND: u64 = 1 << 20;
const BEYOND_TIME: Duration = Duration::from_secs(1);
const WATCH_EVERY: Duration = Duration::from_millis(50);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A running copy.
struct Copy {
    child: Arc<Mutex<Child>>,
    stdin: Option<ChildStdin>,
    stdout: BufReader<ChildStdout>,
    stderr: Option<JoinHandle<()>>,
    last_words: Arc<Mutex<VecDeque<String>>>,
    leash: Arc<Leash>,
}

/// When a copy must have answered.
struct Leash {
    child: Arc<Mutex<Child>>,
    /// Milliseconds since the watch began; 0 where nothing is asked.
    deadline: AtomicU64,
    pulled: AtomicBool,
}

/// Kills what doesn't answer.
struct Watch {
    start: Instant,
    leashes: Mutex<Vec<Arc<Leash>>>,
    over: AtomicBool,
}

impl Watch {
    fn run(&self) {
        while !self.over.load(Ordering::Relaxed) {
            std::thread::sleep(WATCH_EVERY);
            let now = self.start.elapsed().as_millis() as u64;
            for leash in lock(&self.leashes).iter() {
                let deadline = leash.deadline.load(Ordering::Relaxed);
                if deadline > 0 && now > deadline {
                    leash.pulled.store(true, Ordering::Relaxed);
                    let _ = lock(&leash.child).kill();
                }
            }
        }
    }
}

/// A program and as many copies of it as threads ask.
pub(super) struct Process {
    pub command: String,
    words: Vec<String>,
    /// Of an answer, and of the first line.
    timeouts: [Duration; 2],
    pub greeting: Greeting,
    idle: Mutex<Vec<Copy>>,
    watch: Arc<Watch>,
}

impl Process {
    pub fn start(command: &str, timeouts: [Duration; 2]) -> Result<Self, ProgramError> {
        let words = shlex::split(command).filter(|words| !words.is_empty());
        let words = words.ok_or_else(|| ProgramError::Command { command: command.to_owned() })?;
        // In quotes it is an argument like others.
        let bare =
            |word: &&str| words.iter().any(|w| w == word) && command.split_whitespace().any(|w| w == *word);
        if let Some(word) = SHELL.iter().find(|word| bare(word)) {
            return Err(ProgramError::Shell { command: command.to_owned(), word: (*word).to_owned() });
        }
        let watch = Arc::new(Watch {
            start: Instant::now(),
            leashes: Mutex::default(),
            over: AtomicBool::new(false),
        });
        let watching = Arc::clone(&watch);
        std::thread::spawn(move || watching.run());
        let mut process = Self {
            command: command.to_owned(),
            words,
            timeouts,
            greeting: Greeting::default(),
            idle: Mutex::default(),
            watch,
        };
        let (copy, greeting) = process.spawn()?;
        process.greeting = greeting;
        lock(&process.idle).push(copy);
        Ok(process)
    }

    fn spawn(&self) -> Result<(Copy, Greeting), ProgramError> {
        let refused = |why: String| ProgramError::Start { command: self.command.clone(), why };
        let mut command = Command::new(&self.words[0]);
        // Ctrl-C is ours: the program is to answer until we end.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command
            .args(&self.words[1..])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| refused(error.to_string()))?;
        let (Some(stdin), Some(stdout), Some(stderr)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(refused("no pipes".to_owned()));
        };
        let last_words = Arc::new(Mutex::new(VecDeque::new()));
        let heard = Arc::clone(&last_words);
        let listen = move || {
            for line in BufReader::new(stderr).split(b'\n').map_while(Result::ok) {
                let mut heard = lock(&heard);
                heard.push_back(String::from_utf8_lossy(&line[..line.len().min(400)]).trim_end().to_owned());
                if heard.len() > WORDS_KEPT {
                    heard.pop_front();
                }
            }
        };
        let child = Arc::new(Mutex::new(child));
        let leash = Arc::new(Leash {
            child: Arc::clone(&child),
            deadline: AtomicU64::new(0),
            pulled: AtomicBool::new(false),
        });
        lock(&self.watch.leashes).push(Arc::clone(&leash));
        let mut copy = Copy {
            child,
            stdin: Some(stdin),
            stdout: BufReader::with_capacity(1 << 16, stdout),
            stderr: Some(std::thread::spawn(listen)),
            last_words,
            leash,
        };
        let greeting = self.greeting(&mut copy)?;
        Ok((copy, greeting))
    }

    fn greeting(&self, copy: &mut Copy) -> Result<Greeting, ProgramError> {
        let mut line = Vec::new();
        let time = self.timeouts[1];
        self.hold(copy, time);
        let read = copy.stdout.by_ref().take(GREETING_LIMIT).read_until(b'\n', &mut line);
        copy.leash.deadline.store(0, Ordering::Relaxed);
        if read.is_err() || line.is_empty() {
            return Err(self.gone(copy, "before its first line", time, (&[], 0, 0)));
        }
        let wrong = |why: String| ProgramError::Greeting { command: self.command.clone(), why };
        let text = String::from_utf8_lossy(&line).trim_end().to_owned();
        let mut words = text.split_whitespace();
        if words.next() != Some("warpcheck") || !line.ends_with(b"\n") {
            return Err(wrong(format!("it is `{}`", text.chars().take(80).collect::<String>())));
        }
        match words.next() {
            Some("1") => {}
            version => {
                return Err(wrong(format!("it speaks version {}, not 1", version.unwrap_or("of nothing"))));
            }
        }
        let pair = |word: &str| {
            let (key, value) =
                word.split_once('=').ok_or_else(|| wrong(format!("`{word}` is not key=value")))?;
            if !Greeting::KEYS.contains(&key) {
                let near = meant(key, &Greeting::KEYS).map_or_else(
                    || format!("there are {}", Greeting::KEYS.join(", ")),
                    |near| format!("did you mean `{near}`?"),
                );
                return Err(wrong(format!("there is no key `{key}`; {near}")));
            }
            Ok((key.to_owned(), value.to_owned()))
        };
        Ok(Greeting { words: words.map(pair).collect::<Result<_, _>>()? })
    }

    fn hold(&self, copy: &Copy, time: Duration) {
        let deadline = (self.watch.start.elapsed() + time).as_millis() as u64;
        copy.leash.deadline.store(deadline.max(1), Ordering::Relaxed);
    }

    /// What became of a copy whose pipe broke, or who had no more `time`; what there is of its answer, how many bytes are due, and in how many rows.
    fn gone(
        &self,
        copy: &mut Copy,
        when: &str,
        time: Duration,
        (answer, of, rows): (&[u8], usize, usize),
    ) -> ProgramError {
        copy.stdin = None;
        let (command, when) = (self.command.clone(), when.to_owned());
        let hangs = copy.leash.pulled.load(Ordering::Relaxed);
        // A program that closed its pipe but lives on is waited for a little, then killed.
        let patience = Instant::now() + Duration::from_secs(1);
        let status = loop {
            match lock(&copy.child).try_wait() {
                Ok(Some(status)) => break Some(status),
                Ok(None) if Instant::now() < patience => {}
                _ => break None,
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let how = status.map_or_else(|| "closed its output".to_owned(), |status| format!("ended ({status})"));
        copy.end();
        let words: Vec<String> = lock(&copy.last_words).iter().cloned().collect();
        let last_words =
            if words.is_empty() { String::new() } else { format!("; it said: {}", words.join(" | ")) };
        let (seconds, bytes) = (time.as_secs_f64(), answer.len());
        let what = || text_among(answer, 0).map(only_answers).or_else(|| widths(bytes, of, rows));
        match (hangs, bytes) {
            (true, 0) => ProgramError::Hangs { command, seconds, when, last_words },
            (true, _) => {
                let late = || "is all of it flushed? (--timeout gives it longer)".to_owned();
                let what = what().unwrap_or_else(late);
                ProgramError::Short { command, bytes, of, seconds, when, what, last_words }
            }
            (false, 0) => ProgramError::Died { command, how, when, last_words },
            (false, _) => {
                let what = what().map_or_else(String::new, |what| format!(": {what}"));
                let when = format!("{when}, after {bytes} of {of} bytes{what}");
                ProgramError::Died { command, how, when, last_words }
            }
        }
    }

    /// What a copy wrote beyond its answer, which stands in front of it. It is ended.
    fn too_much(&self, copy: &mut Copy, answer: &[u8], rows: usize, when: &str) -> ProgramError {
        copy.stdin = None;
        let mut all = answer.to_vec();
        self.hold(copy, BEYOND_TIME.min(self.timeouts[0]));
        let _ = copy.stdout.by_ref().take(BEYOND).read_to_end(&mut all);
        copy.leash.deadline.store(0, Ordering::Relaxed);
        copy.end();
        let bytes = all.len() - answer.len();
        let what =
            text_among(&all, bytes).map(only_answers).or_else(|| widths(all.len(), answer.len(), rows));
        let what = what.map_or_else(String::new, |what| format!(": {what}"));
        ProgramError::TooMuch { command: self.command.clone(), bytes, when: format!(" {when}"), what }
    }

    /// Asks `word` of `count` rows of numbers; the answer has `each` numbers for every row.
    pub fn ask(
        &self,
        word: &str,
        rows: &[f64],
        width: usize,
        each: usize,
        out: &mut Vec<f64>,
    ) -> Result<(), ProgramError> {
        out.clear();
        if rows.is_empty() {
            return Ok(());
        }
        let idle = lock(&self.idle).pop();
        let mut copy = match idle {
            Some(copy) => copy,
            None => self.spawn()?.0,
        };
        let most = REQUEST.min(NUMBERS / width.max(1)).max(1);
        let (mut question, mut answer) = (Vec::new(), Vec::new());
        for rows in rows.chunks(most * width) {
            let count = rows.len() / width;
            let when = || format!("when asked `{word} {count}`");
            // What is left over would be taken for the beginning of every answer from here on. And the program would be that far ahead of us: once its
            // pipe is full of what nobody reads, it waits for us to read, and we for it to take a question.
            if !copy.stdout.buffer().is_empty() {
                return Err(self.too_much(
                    &mut copy,
                    &[],
                    0,
                    &format!("before it was asked `{word} {count}`"),
                ));
            }
            question.clear();
            question.extend(format!("{word} {count}\n").bytes());
            rows.iter().for_each(|x| question.extend(x.to_le_bytes()));
            self.hold(&copy, self.timeouts[0]);
            let written = match &mut copy.stdin {
                Some(stdin) => stdin.write_all(&question).and_then(|()| stdin.flush()),
                None => Err(std::io::ErrorKind::BrokenPipe.into()),
            };
            answer.resize(8 * count * each, 0);
            // Who can't be written to may have left something to read all the same.
            let read = copy.read(&mut answer);
            copy.leash.deadline.store(0, Ordering::Relaxed);
            if written.is_err() || read < answer.len() {
                return Err(self.gone(
                    &mut copy,
                    &when(),
                    self.timeouts[0],
                    (&answer[..read], answer.len(), count),
                ));
            }
            if !copy.stdout.buffer().is_empty() {
                return Err(self.too_much(&mut copy, &answer, count, &when()));
            }
            out.extend(answer.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)));
        }
        lock(&self.idle).push(copy);
        Ok(())
    }

    /// Ends all copies, and looks whether one wrote more than it was asked for.
    pub fn finish(&self) -> Result<(), ProgramError> {
        for mut copy in std::mem::take(&mut *lock(&self.idle)) {
            copy.stdin = None;
            self.hold(&copy, self.timeouts[0]);
            let mut rest = Vec::new();
            let _ = copy.stdout.by_ref().take(BEYOND).read_to_end(&mut rest);
            copy.leash.deadline.store(0, Ordering::Relaxed);
            copy.end();
            if !rest.is_empty() {
                let what = text_among(&rest, rest.len()).map(only_answers);
                let what = what.map_or_else(String::new, |what| format!(": {what}"));
                let (command, bytes) = (self.command.clone(), rest.len());
                return Err(ProgramError::TooMuch { command, bytes, when: String::new(), what });
            }
        }
        Ok(())
    }
}

impl Copy {
    /// Reads as far as there is something to read, and says how many bytes came.
    fn read(&mut self, out: &mut [u8]) -> usize {
        let mut came = 0;
        while came < out.len() {
            match self.stdout.read(&mut out[came..]) {
                Ok(n) if n > 0 => came += n,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                _ => break,
            }
        }
        came
    }

    fn end(&mut self) {
        self.stdin = None;
        let mut child = lock(&self.child);
        let _ = child.kill();
        let _ = child.wait();
        drop(child);
        if let Some(stderr) = self.stderr.take() {
            // Its own children may hold the pipe open: they are not waited for.
            let patience = Instant::now() + Duration::from_millis(200);
            while !stderr.is_finished() && Instant::now() < patience {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    }
}

impl Drop for Copy {
    fn drop(&mut self) {
        self.end();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        lock(&self.idle).clear();
        self.watch.over.store(true, Ordering::Relaxed);
    }
}
