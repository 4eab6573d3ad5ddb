//! Messages of Arrow, looked over before they are decoded: checksums tell damage, not malice, and the
//! decoder takes a message's word for where its parts lie and how large they become.

use arrow_ipc::{Block, CompressionType, RecordBatch};
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
pub fn check_batch(bytes: &[u8]) -> Result<Block, &'static str> {
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
    check_parts(&batch.ok_or("it is no batch of rows")?, body)?;
    Ok(Block::new(0, metadata.len() as i32, body.len() as i64))
}

fn check_parts(batch: &RecordBatch, body: &[u8]) -> Result<(), &'static str> {
    let is_compressed = match batch.compression() {
        None => false,
        Some(compression) if compression.codec() == CompressionType::ZSTD => true,
        Some(_) => return Err("it is not compressed with Zstandard"),
    };
    // Bytes of all buffers once they are decoded.
    let mut bytes = 0_u64;
    for buffer in batch.buffers().into_iter().flatten() {
        let range = usize::try_from(buffer.offset())
            .ok()
            .zip(usize::try_from(buffer.length()).ok())
            .and_then(|(start, length)| body.get(start..start.checked_add(length)?));
        let range = range.ok_or("a column lies outside of it")?;
        bytes += match range.first_chunk::<LENGTH_PREFIX>() {
            Some(&length) if is_compressed => {
                let stored = (range.len() - LENGTH_PREFIX) as u64;
                match i64::from_le_bytes(length) {
                    -1 => stored,
                    length => u64::try_from(length)
                        .ok()
                        .filter(|&length| length <= stored.saturating_mul(MOST_GROWTH))
                        .ok_or("a column says that it becomes larger than it can")?,
                }
            }
            None if is_compressed && !range.is_empty() => return Err("a column is too short"),
            _ => range.len() as u64,
        };
    }
    // A row takes a bit at least.
    let rows = |count: i64| {
        u64::try_from(count)
            .ok()
            .filter(|&count| count <= 8 * bytes)
    };
    let too_many = "it says that it has more rows than bytes";
    rows(batch.length()).ok_or(too_many)?;
    for node in batch.nodes().into_iter().flatten() {
        let length = rows(node.length()).ok_or(too_many)?;
        rows(node.null_count())
            .filter(|&gaps| gaps <= length)
            .ok_or("a column has more gaps than rows")?;
    }
    Ok(())
}
