//! What comes on the script ports, without a socket: whole scripts out of whatever split of bytes.

/// The longest script that is kept (bytes); ur_rtde's has 42 thousand.
const LONGEST: usize = 1 << 20;

/// Gathers lines until a script is whole: from `def …` to an `end` at the line's beginning; any other line is a
/// script of its own.
#[derive(Debug, Default)]
pub(super) struct Scripts {
    unread: Vec<u8>,
    script: Vec<u8>,
    /// A script that was too long is thrown away up to its end.
    too_long: bool,
}

impl Scripts {
    /// Some bytes came; the scripts that are whole now.
    pub(super) fn hear(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        self.unread.extend_from_slice(bytes);
        let unread = std::mem::take(&mut self.unread);
        let mut whole = Vec::new();
        let mut lines = unread.split_inclusive(|byte| *byte == b'\n').peekable();
        while let Some(line) = lines.next() {
            if lines.peek().is_none() && !line.ends_with(b"\n") {
                self.unread = line.to_vec();
                break;
            }
            whole.extend(self.line(line));
        }
        if self.unread.len() > LONGEST {
            self.unread.clear();
        }
        whole
    }

    /// The connection ended: a last line without its end counts.
    pub(super) fn end(&mut self) -> Option<Vec<u8>> {
        let last = std::mem::take(&mut self.unread);
        self.line(&last)
    }

    fn line(&mut self, line: &[u8]) -> Option<Vec<u8>> {
        let first = self.script.is_empty() && !self.too_long;
        let text = line.trim_ascii();
        if first && (text.is_empty() || text.starts_with(b"#")) {
            return None;
        }
        if first && !begins(text) {
            return Some(line.to_vec());
        }
        if self.script.len() + line.len() > LONGEST {
            self.too_long = true;
            self.script.clear();
        }
        if !self.too_long {
            self.script.extend_from_slice(line);
        }
        if line.trim_ascii_end() != b"end" {
            return None;
        }
        let script = std::mem::take(&mut self.script);
        (!std::mem::take(&mut self.too_long)).then_some(script)
    }
}

fn begins(line: &[u8]) -> bool {
    line.starts_with(b"def ") || line.starts_with(b"sec ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_is_whole_at_its_end_however_its_bytes_are_split() {
        let text = b"# hello\nmovej([0,0,0,0,0,0])\ndef a():\n  def b():\n  end\n  x = 1\nend\nstopj(2)\n";
        for size in 1..text.len() {
            let mut scripts = Scripts::default();
            let all: Vec<Vec<u8>> = text.chunks(size).flat_map(|chunk| scripts.hear(chunk)).collect();
            assert_eq!(all.len(), 3, "{size}");
            assert!(all[1].starts_with(b"def a()") && all[1].ends_with(b"end\n"));
        }
    }

    #[test]
    fn no_script_takes_more_memory_than_it_may() {
        let mut scripts = Scripts::default();
        assert!(scripts.hear(b"def a():\n").is_empty());
        for _ in 0..40 {
            let long = [vec![b'x'; 100_000], vec![b'\n']].concat();
            assert!(scripts.hear(&long).is_empty());
            assert!(scripts.script.len() <= LONGEST && scripts.unread.len() <= LONGEST);
        }
        assert!(scripts.hear(b"end\n").is_empty(), "it was cut, so it is none");
        assert_eq!(scripts.hear(b"stopj(2)\n").len(), 1);
    }
}
