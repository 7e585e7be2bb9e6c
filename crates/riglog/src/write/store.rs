//! The file under a log: grows by whole records, and is cut back to them when a write fails half-way.

use std::{
    fs::File,
    io::{self, Seek, SeekFrom, Write},
};

/// What the writer needs of a file; tests stand in with disks that fill up.
pub(crate) trait Store: Send {
    /// Writes some of `bytes` at the end.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize>;
    /// Cuts the file back to `bytes`, where the next write goes on.
    fn truncate(&mut self, bytes: u64) -> io::Result<()>;
}

impl Store for File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Write::write(self, bytes)
    }

    fn truncate(&mut self, bytes: u64) -> io::Result<()> {
        self.set_len(bytes)?;
        self.seek(SeekFrom::Start(bytes)).map(drop)
    }
}

/// The end of the file, which always lies between two records.
pub(crate) struct Tail {
    store: Box<dyn Store>,
    at_byte: u64,
}

impl Tail {
    /// The tail of an empty file.
    pub(crate) fn new(store: Box<dyn Store>) -> Self {
        Self { store, at_byte: 0 }
    }

    pub(crate) fn at_byte(&self) -> u64 {
        self.at_byte
    }

    /// Hands whole records to the operating system, in one call unless it takes only a part.
    ///
    /// # Errors
    /// The system's; the file then ends where it did before, as far as it can be cut back.
    pub(crate) fn append(&mut self, records: &[u8]) -> io::Result<()> {
        let mut left = records;
        while !left.is_empty() {
            match self.store.write(left) {
                Ok(0) => return self.cut_back(io::ErrorKind::WriteZero.into()),
                Ok(taken) => left = &left[taken..],
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return self.cut_back(error),
            }
        }
        self.at_byte += records.len() as u64;
        Ok(())
    }

    fn cut_back(&mut self, error: io::Error) -> io::Result<()> {
        // Where even this fails, a reader stops at the last whole record all the same.
        let _ = self.store.truncate(self.at_byte);
        Err(error)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    /// A disk of limited size, whose content a test may look at.
    #[derive(Clone)]
    pub(crate) struct FullDisk {
        pub(crate) content: Arc<Mutex<Vec<u8>>>,
        pub(crate) room: Arc<Mutex<usize>>,
    }

    impl FullDisk {
        pub(crate) fn with_room(room: usize) -> Self {
            Self { content: Arc::default(), room: Arc::new(Mutex::new(room)) }
        }

        pub(crate) fn bytes(&self) -> Vec<u8> {
            self.content.lock().unwrap().clone()
        }
    }

    impl Store for FullDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            const ENOSPC: i32 = 28;
            let mut content = self.content.lock().unwrap();
            let free = self.room.lock().unwrap().saturating_sub(content.len());
            if free == 0 {
                return Err(io::Error::from_raw_os_error(ENOSPC));
            }
            // Like a real disk, it takes what still fits.
            let taken = bytes.len().min(free);
            content.extend_from_slice(&bytes[..taken]);
            Ok(taken)
        }

        fn truncate(&mut self, bytes: u64) -> io::Result<()> {
            self.content.lock().unwrap().truncate(bytes as usize);
            Ok(())
        }
    }

    #[test]
    fn a_write_that_fails_half_way_leaves_no_half_records() {
        let disk = FullDisk::with_room(10);
        let mut tail = Tail::new(Box::new(disk.clone()));
        tail.append(b"whole").unwrap();
        let error = tail.append(b"too long").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(disk.bytes(), b"whole");
        tail.append(b"fits").unwrap();
        assert_eq!((tail.at_byte(), disk.bytes()), (9, b"wholefits".to_vec()));
    }
}
