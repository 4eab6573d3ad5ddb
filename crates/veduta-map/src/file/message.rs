//! Messages of Arrow, looked over before they are decoded: checksums tell damage, not malice, and the
//! decoder takes a message's word for where its parts lie and how large they become.

use arrow_ipc::{Block, Buffer, CompressionType, FieldNode};
use arrow_schema::{DataType, Schema};

/// Bytes that head a message: a mark and the length of what it says of its parts.
const PREFIX: usize = 8;

/// The mark.
const CONTINUATION: [u8; 4] = [0xff; 4];

/// Bytes that one byte of Zstandard may become: a run of 128 KiB takes four. Our own tables come near
/// to that (a column of one number), so smaller would refuse honest files.
const MOST_GROWTH: u64 = 32 << 10;

/// Bytes that head a compressed buffer: its length without compression, or -1.
const LENGTH_PREFIX: usize = 8;

/// Refuses columns of types that no table has: each kind of column that the decoder knows is one more way
/// to mislead it.
pub fn check_schema(schema: &Schema) -> Result<(), String> {
    for field in &schema.fields {
        let is_known = match field.data_type() {
            DataType::List(values) => *values.data_type() == DataType::UInt32,
            DataType::FixedSizeList(values, 16) => *values.data_type() == DataType::Float64,
            plain => matches!(
                plain,
                DataType::UInt32
                    | DataType::Float32
                    | DataType::Float64
                    | DataType::Boolean
                    | DataType::Utf8
                    | DataType::LargeBinary
            ),
        };
        if !is_known {
            let (name, found) = (field.name(), field.data_type());
            return Err(format!(
                "the column `{name}` is of the type {found}, which no table has"
            ));
        }
    }
    Ok(())
}

/// Where the two parts of a batch lie in `bytes`, if all that it says of them can be true.
pub fn check_batch(bytes: &[u8], schema: &Schema) -> Result<Block, &'static str> {
    let head = bytes.split_at_checked(PREFIX).ok_or("it is too short")?.0;
    let (mark, length) = head.split_at(4);
    let length = i32::from_le_bytes(length.try_into().map_err(|_| "it is too short")?);
    let metadata = usize::try_from(length).ok().map(|length| PREFIX + length);
    let parts = metadata.and_then(|end| bytes.split_at_checked(end));
    let (metadata, body) = parts.ok_or("it is shorter than it says")?;
    if mark != CONTINUATION {
        return Err("it does not begin as messages do");
    }
    let message = arrow_ipc::root_as_message(&metadata[PREFIX..]);
    let message = message.map_err(|_| "what it says of itself cannot be read")?;
    let batch = message.header_as_record_batch();
    let batch = batch.ok_or("it is no batch of rows")?;
    let is_compressed = match batch.compression() {
        None => false,
        Some(compression) if compression.codec() == CompressionType::ZSTD => true,
        Some(_) => return Err("it is not compressed with Zstandard"),
    };
    let mut parts = Parts {
        nodes: batch.nodes().into_iter().flatten(),
        buffers: batch.buffers().into_iter().flatten(),
        body,
        is_compressed,
    };
    let rows = u64::try_from(batch.length()).map_err(|_| "it has fewer than no rows")?;
    for field in &schema.fields {
        if parts.check_column(field.data_type())? != rows {
            return Err("its columns are not as long as it is");
        }
    }
    Ok(Block::new(0, metadata.len() as i32, body.len() as i64))
}

/// The parts of a batch, in the order of its columns.
struct Parts<'a, N, B> {
    nodes: N,
    buffers: B,
    body: &'a [u8],
    is_compressed: bool,
}

impl<'a, N: Iterator<Item = &'a FieldNode>, B: Iterator<Item = &'a Buffer>> Parts<'a, N, B> {
    /// Rows of the next column, all of whose buffers are long enough for them.
    fn check_column(&mut self, data_type: &DataType) -> Result<u64, &'static str> {
        let node = self.nodes.next().ok_or("a column is missing")?;
        let rows = u64::try_from(node.length()).map_err(|_| "a column has fewer than no rows")?;
        let gaps = u64::try_from(node.null_count()).ok();
        let gaps = gaps.filter(|&gaps| gaps <= rows);
        let gaps = gaps.ok_or("a column has more gaps than rows")?;
        // A bit for each row, if there are gaps.
        self.check_buffer(if gaps > 0 { rows.div_ceil(8) } else { 0 }, 1)?;
        match data_type {
            DataType::Boolean => self.check_buffer(rows.div_ceil(8), 1)?,
            DataType::Float64 => self.check_buffer(rows.saturating_mul(8), 8)?,
            DataType::Utf8 => {
                self.check_ends(rows, 4)?;
                self.check_buffer(0, 1)?;
            }
            DataType::LargeBinary => {
                self.check_ends(rows, 8)?;
                self.check_buffer(0, 1)?;
            }
            DataType::List(values) => {
                self.check_ends(rows, 4)?;
                self.check_column(values.data_type())?;
            }
            DataType::FixedSizeList(values, _) => {
                self.check_column(values.data_type())?;
            }
            _ => self.check_buffer(rows.saturating_mul(4), 4)?,
        }
        Ok(rows)
    }

    /// The next buffer, which tells where rows end; without rows it may be empty.
    fn check_ends(&mut self, rows: u64, size: u64) -> Result<(), &'static str> {
        let ends = if rows == 0 { 0 } else { rows.saturating_add(1) };
        self.check_buffer(ends.saturating_mul(size), size)
    }

    /// The next buffer: at least `least` bytes once it is decoded, and whole values of `size` bytes.
    fn check_buffer(&mut self, least: u64, size: u64) -> Result<(), &'static str> {
        let buffer = self.buffers.next().ok_or("a column is missing")?;
        let range = usize::try_from(buffer.offset())
            .ok()
            .zip(usize::try_from(buffer.length()).ok())
            .and_then(|(start, length)| self.body.get(start..start.checked_add(length)?));
        let range = range.ok_or("a column lies outside of it")?;
        let length = match range.first_chunk::<LENGTH_PREFIX>() {
            Some(&length) if self.is_compressed => {
                let stored = (range.len() - LENGTH_PREFIX) as u64;
                match i64::from_le_bytes(length) {
                    -1 => stored,
                    length => u64::try_from(length)
                        .ok()
                        .filter(|&length| length <= stored.saturating_mul(MOST_GROWTH))
                        .ok_or("a column says that it becomes larger than it can")?,
                }
            }
            None if self.is_compressed && !range.is_empty() => return Err("a column is too short"),
            _ => range.len() as u64,
        };
        if length < least || length % size != 0 {
            return Err("a column is not as long as its rows");
        }
        Ok(())
    }
}
