//! NumPy's `.npz`: a zip archive of arrays, as they are or deflated. Each is read by a thread of its own, so that none has to fit into memory
//! unless it was written column after column.

use super::binary::SideBySide;
use super::error::{ReadError, in_line};
use super::npy::{self, Named, NpyHeader};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

const BLOCK: usize = 1 << 18;

/// What a thread reads for another one.
struct Piped {
    blocks: Receiver<std::io::Result<Vec<u8>>>,
    block: Vec<u8>,
    at: usize,
}

impl Read for Piped {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        while self.at == self.block.len() {
            match self.blocks.recv() {
                Ok(block) => (self.block, self.at) = (block?, 0),
                Err(_) => return Ok(0),
            }
        }
        let n = out.len().min(self.block.len() - self.at);
        out[..n].copy_from_slice(&self.block[self.at..][..n]);
        self.at += n;
        Ok(n)
    }
}

fn member(path: PathBuf, index: usize) -> Piped {
    let (send, blocks) = sync_channel(4);
    std::thread::spawn(move || {
        if let Err(error) = send_member(&path, index, &send) {
            let _ = send.send(Err(error));
        }
    });
    Piped { blocks, block: Vec::new(), at: 0 }
}

fn send_member(
    path: &Path,
    index: usize,
    send: &SyncSender<std::io::Result<Vec<u8>>>,
) -> std::io::Result<()> {
    let mut archive = zip::ZipArchive::new(std::io::BufReader::new(File::open(path)?))?;
    let mut file = archive.by_index(index)?;
    loop {
        let mut block = Vec::with_capacity(BLOCK);
        file.by_ref().take(BLOCK as u64).read_to_end(&mut block)?;
        if block.is_empty() || send.send(Ok(block)).is_err() {
            return Ok(()); // or nobody listens any more
        }
    }
}

/// The arrays of an archive as columns: one with two axes holds the point (and what `--columns` says), each of the others is a column of its own name.
pub(super) fn rows(path: &Path) -> Result<Named, ReadError> {
    let name = path.display().to_string();
    let unread = |why: String| ReadError::Read { name: name.clone(), why };
    let file = File::open(path).map_err(|error| unread(error.to_string()))?;
    let archive = zip::ZipArchive::new(std::io::BufReader::new(file));
    let mut archive = archive.map_err(|error| unread(error.to_string()))?;
    let archive_len = archive.len();
    let mut called = |index: usize| Ok(archive.by_index_raw(index)?.name()?.into_owned());
    let arrays: Result<Vec<String>, zip::result::ZipError> = (0..archive_len).map(&mut called).collect();
    let arrays = arrays.map_err(|error| unread(error.to_string()))?;
    if arrays.is_empty() {
        return Err(ReadError::Empty { name });
    }
    let (mut all, mut names, mut first) = (Vec::new(), Vec::new(), None::<(String, u64)>);
    for (index, array) in arrays.iter().enumerate() {
        let column = in_line(array.strip_suffix(".npy").unwrap_or(array));
        let label = format!("{name}, array `{column}`");
        let mut reader = member(path.to_owned(), index);
        let header = NpyHeader::read(&label, &mut reader)?;
        let (count, columns) = header.rows_and_columns(&label)?;
        match &first {
            Some((other, rows)) if *rows != count => {
                let why = format!("it has {count} rows, but `{other}` has {rows}");
                return Err(ReadError::Header { name: label, why });
            }
            _ => first = first.or(Some((column.clone(), count))),
        }
        let (rows, fields) = npy::rows(&label, &header, Box::new(reader), None)?;
        match (columns, fields.is_empty()) {
            (_, false) => names.extend(fields),
            (1, true) => names.push(column),
            // Named by the domain: see `source`.
            (_, true) => names.extend((0..columns).map(|_| String::new())),
        }
        all.push(rows);
    }
    Ok((Box::new(SideBySide(all)), names))
}
