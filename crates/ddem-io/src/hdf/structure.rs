//! Blocks of an HDF5 file that describe its arrays.
//!
//! HDF5 has no function that tells where they are. `hdf` makes all files with the oldest version of the
//! [format](https://support.hdfgroup.org/documentation/hdf5/latest/_f_m_t1.html), whose parts are named in brackets here.
//! Arrays grow at their end. An append therefore changes the header of an array, the nodes of the index of its chunks on
//! the way to the last chunk, and this chunk if a part of it is empty. All else that it writes is after the former end.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use serde::{Deserialize, Serialize};

/// Superblock [II.A]: signature with version 0, sizes of addresses and lengths, places of other numbers, and its own size.
const SIGNATURE: &[u8; 9] = b"\x89HDF\r\n\x1a\n\0";
const SIZES: usize = 13;
const GROUP_ENTRIES: [usize; 2] = [16, 18];
const END: usize = 40;
const ROOT: usize = 64;
const SUPERBLOCK: usize = 96;

/// Address of an index that does not exist yet.
const NOWHERE: u64 = u64::MAX;

/// Half of the children of a node in an index of chunks [III.A.1].
const CHUNK_ENTRIES: usize = 32;

/// Largest number and size of the blocks of a file. Those of a damaged file may refer to each other in a circle.
const MOST_BLOCKS: usize = 2000;
const LARGEST_BLOCK: usize = 1 << 24;

/// Bytes of a file from a position on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileBlock {
    pub(super) at: u64,
    pub(super) bytes: Vec<u8>,
}

/// Blocks that describe the arrays of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Structure {
    /// Length of the file by its superblock.
    pub(super) end: u64,
    /// Blocks of groups that no append changes, among them all names.
    pub(super) fixed: Vec<FileBlock>,
    /// Blocks that an append may change. A node comes before its children, and an array before its group, which may count
    /// the steps. Whoever replaces them by later ones in this order, or by former ones in the opposite order, leaves all
    /// data of both readable at any moment.
    pub(super) growing: Vec<FileBlock>,
}

/// FilePages of a file that have been read, because its blocks are many and small.
pub(super) struct FilePages<'a> {
    file: &'a File,
    length: u64,
    read: BTreeMap<u64, Vec<u8>>,
}

/// Bytes of a page.
const PAGE: usize = 8192;

impl<'a> FilePages<'a> {
    pub(super) fn of(file: &'a File) -> io::Result<Self> {
        Ok(Self { file, length: file.metadata()?.len(), read: BTreeMap::new() })
    }

    /// FilePages so far, which contain all blocks so far.
    pub(super) fn into_blocks(self) -> impl Iterator<Item = FileBlock> {
        self.read.into_iter().map(|(page, bytes)| FileBlock { at: page * PAGE as u64, bytes })
    }

    /// Reads a block.
    pub(super) fn block(&mut self, at: u64, size: usize) -> io::Result<FileBlock> {
        let end = at.checked_add(size as u64).filter(|&end| end <= self.length);
        let end = end.ok_or_else(damaged)?;
        let mut bytes = Vec::with_capacity(size);
        while bytes.len() < size {
            let next = at + bytes.len() as u64;
            let page = next / PAGE as u64;
            let own = self.page(page)?;
            let start = (next - page * PAGE as u64) as usize;
            bytes.extend(own[start..].iter().take((end - next) as usize));
        }
        Ok(FileBlock { at, bytes })
    }

    fn page(&mut self, page: u64) -> io::Result<&[u8]> {
        let at = page * PAGE as u64;
        let size = (self.length - at).min(PAGE as u64) as usize;
        match self.read.entry(page) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(new) => {
                let mut bytes = vec![0; size];
                let mut file = self.file;
                file.seek(SeekFrom::Start(at))?;
                file.read_exact(&mut bytes)?;
                Ok(new.insert(bytes))
            }
        }
    }

    /// Length of the file by its superblock.
    pub(super) fn end(&mut self) -> io::Result<u64> {
        number(&self.block(0, SUPERBLOCK)?.bytes, END, 8)
    }
}

impl Structure {
    /// Reads the blocks of a file.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::InvalidData`] if the file is damaged or has another version of the format.
    pub(super) fn read(pages: &mut FilePages<'_>) -> io::Result<Self> {
        let superblock = pages.block(0, SUPERBLOCK)?;
        let number = |at, size| number(&superblock.bytes, at, size);
        if !superblock.bytes.starts_with(SIGNATURE) || number(SIZES, 2)? != 0x0808 {
            return Err(damaged());
        }
        let [leaf, node] = GROUP_ENTRIES;
        let group_entries = [number(leaf, 2)? as usize, number(node, 2)? as usize];
        let (end, root) = (number(END, 8)?, number(ROOT, 8)?);
        if end > pages.length {
            return Err(damaged());
        }
        let (fixed, arrays, groups) = (Vec::new(), Vec::new(), Vec::new());
        let mut walk = Walk { pages, group_entries, read: 0, fixed, arrays, groups };
        walk.object(root)?;
        let Walk { fixed, arrays, groups, .. } = walk;
        Ok(Self { end, fixed, growing: [vec![superblock], arrays, groups].concat() })
    }
}

/// Index of the chunks of an array.
struct Chunks {
    index: u64,
    /// Number of axes, with that of the bytes of a number.
    axes: usize,
    /// Rows of a chunk.
    rows: u64,
}

/// Walk through the objects of a file.
struct Walk<'a, 'b> {
    pages: &'a mut FilePages<'b>,
    /// Half of the entries of a leaf and of a node in a group.
    group_entries: [usize; 2],
    /// Number of blocks so far.
    read: usize,
    fixed: Vec<FileBlock>,
    arrays: Vec<FileBlock>,
    groups: Vec<FileBlock>,
}

impl Walk<'_, '_> {
    fn read(&mut self, at: u64, size: usize) -> io::Result<FileBlock> {
        self.read += 1;
        if self.read > MOST_BLOCKS || size > LARGEST_BLOCK {
            return Err(damaged());
        }
        self.pages.block(at, size)
    }

    /// Object header [IV.A.1.a] with all below it.
    fn object(&mut self, at: u64) -> io::Result<()> {
        const PREFIX: usize = 16;
        let prefix = self.read(at, PREFIX)?;
        if prefix.bytes[0] != 1 {
            return Err(damaged());
        }
        let size = number(&prefix.bytes, 8, 4)? as usize;
        let mut header = vec![self.read(at, PREFIX + size)?];
        let (mut rows, mut chunks, mut group) = (0, None, None);
        let mut block = 0;
        while let Some(FileBlock { bytes, .. }) = header.get(block) {
            let bytes = &bytes[if block == 0 { PREFIX } else { 0 }..];
            let mut next = Vec::new();
            for (kind, data) in messages(bytes) {
                match kind {
                    DATASPACE => rows = first_length(data)?,
                    LAYOUT => chunks = chunks_of(data)?,
                    CONTINUATION => {
                        next.push(self.read(number(data, 0, 8)?, number(data, 8, 8)? as usize)?)
                    }
                    SYMBOL_TABLE => group = Some([number(data, 0, 8)?, number(data, 8, 8)?]),
                    _ => {}
                }
            }
            header.extend(next);
            block += 1;
        }
        if let Some([index, heap]) = group {
            self.names(heap)?;
            self.members(index, None)?;
            self.groups.extend(header);
        } else {
            if let Some(chunks) = chunks {
                self.last_chunk(chunks, rows)?;
            }
            self.arrays.extend(header);
        }
        Ok(())
    }

    /// Local heap [III.D].
    fn names(&mut self, at: u64) -> io::Result<()> {
        let heap = self.read(at, 32)?;
        let (size, data) = (number(&heap.bytes, 8, 8)?, number(&heap.bytes, 24, 8)?);
        self.fixed.push(heap);
        let names = self.read(data, size as usize)?;
        self.fixed.push(names);
        Ok(())
    }

    /// Members of a group below a node of its index, which is one `level` above its leaves.
    fn members(&mut self, at: u64, level: Option<u8>) -> io::Result<()> {
        let [leaf_entries, node_entries] = self.group_entries;
        let node = self.read(at, NODE_HEAD + 8 * (4 * node_entries + 1))?;
        let (found, used) = node_head(&node.bytes, 0, level)?;
        let children: Vec<u64> = (0..used)
            .map(|child| number(&node.bytes, NODE_HEAD + 8 + 16 * child, 8))
            .collect::<io::Result<_>>()?;
        self.fixed.push(node);
        for child in children {
            if let Some(below) = found.checked_sub(1) {
                self.members(child, Some(below))?;
                continue;
            }
            // Symbol table node [III.B] with entries [III.C].
            let leaf = self.read(child, 8 + 40 * 2 * leaf_entries)?;
            let entries = number(&leaf.bytes, 6, 2)? as usize;
            let objects: Vec<u64> = (0..entries)
                .map(|entry| number(&leaf.bytes, 16 + 40 * entry, 8))
                .collect::<io::Result<_>>()?;
            self.fixed.push(leaf);
            objects.into_iter().try_for_each(|object| self.object(object))?;
        }
        Ok(())
    }

    /// Nodes on the way to the last chunk of an array with a number of rows, and this chunk if a part of it is empty.
    fn last_chunk(&mut self, Chunks { index, axes, rows }: Chunks, all: u64) -> io::Result<()> {
        let key = 8 + 8 * axes;
        let (mut at, mut level) = (index, None);
        while at != NOWHERE {
            let node = self.read(at, NODE_HEAD + key + 2 * CHUNK_ENTRIES * (key + 8))?;
            let (found, used) = node_head(&node.bytes, 1, level)?;
            let Some(last) = used.checked_sub(1) else {
                self.arrays.push(node);
                break;
            };
            let entry = NODE_HEAD + last * (key + 8);
            let size = number(&node.bytes, entry, 4)? as usize;
            let child = number(&node.bytes, entry + key, 8)?;
            self.arrays.push(node);
            level = found.checked_sub(1);
            if level.is_none() {
                if !all.is_multiple_of(rows) {
                    let chunk = self.read(child, size)?;
                    self.arrays.push(chunk);
                }
                break;
            }
            at = child;
        }
        Ok(())
    }
}

/// Messages of an object header that matter here [IV.A.2].
const DATASPACE: u64 = 0x01;
const LAYOUT: u64 = 0x08;
const CONTINUATION: u64 = 0x10;
const SYMBOL_TABLE: u64 = 0x11;

/// Kinds and data of the messages in a part of an object header.
fn messages(mut bytes: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    std::iter::from_fn(move || {
        let (head, rest) = bytes.split_at_checked(8)?;
        let size = number(head, 2, 2).ok()? as usize;
        let (data, rest) = rest.split_at_checked(size)?;
        bytes = rest;
        Some((number(head, 0, 2).ok()?, data))
    })
}

/// Length of an array along its first axis, from its dataspace [IV.A.2.b]; 0 for a single number.
fn first_length(data: &[u8]) -> io::Result<u64> {
    let [version, axes] = [number(data, 0, 1)?, number(data, 1, 1)?];
    let before = if version == 1 { 8 } else { 4 };
    if axes == 0 { Ok(0) } else { number(data, before, 8) }
}

/// Chunks of an array, if it has any, from its layout [IV.A.2.i].
fn chunks_of(data: &[u8]) -> io::Result<Option<Chunks>> {
    const CHUNKED: u64 = 2;
    if number(data, 0, 1)? != 3 {
        return Err(damaged());
    }
    if number(data, 1, 1)? != CHUNKED {
        return Ok(None);
    }
    let (axes, index) = (number(data, 2, 1)? as usize, number(data, 3, 8)?);
    Ok(Some(Chunks { index, axes, rows: number(data, 11, 4)?.max(1) }))
}

/// Size of the head of a node [III.A.1].
const NODE_HEAD: usize = 24;

/// Level of a node above its leaves, and number of its children. The node must have a kind, and a `level` if it is given.
fn node_head(bytes: &[u8], kind: u8, level: Option<u8>) -> io::Result<(u8, usize)> {
    let used = number(bytes, 6, 2)? as usize;
    match *bytes {
        [b'T', b'R', b'E', b'E', of, found, ..]
            if of == kind && level.is_none_or(|level| level == found) =>
        {
            Ok((found, used))
        }
        _ => Err(damaged()),
    }
}

/// Whole number of some bytes at a place, the least byte first.
fn number(bytes: &[u8], at: usize, size: usize) -> io::Result<u64> {
    let own = bytes.get(at..at + size).ok_or_else(damaged)?;
    Ok(own.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
}

fn damaged() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "a part of its structure is missing or unknown")
}
