//! Slips of the pen that leave one reading only, in parts that are not needed or mere spelling.

/// A message statement whose sender is missing or no name: the sender is not needed.
pub(super) fn message(text: &str) -> Option<String> {
    let (head, tail) = text.split_once(':')?;
    let tail = tail.trim_start();
    let size_end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
    let (size, sender) = tail.split_at(size_end);
    (is_names(sender) && (sender.is_empty() || sender.starts_with([' ', '\t', ';'])))
        .then(|| format!("{head}: {size} Vector__XXX"))
}

/// A signal statement with an unreadable range, odd or missing receivers, or a number like `1.`:
/// range and receivers are not needed.
pub(super) fn signal(text: &str) -> Option<String> {
    let (head, after_head) = text.split_once('(')?;
    let (scale, after_scale) = after_head.split_once(')')?;
    let (factor, offset) = scale.split_once(',')?;
    let (range, after_range) = after_scale.split_once('"').unwrap_or((after_scale, "\""));
    let (unit, receivers) = after_range.split_once('"')?;
    // Anything else in these places could be another signal on the same line.
    let range_is_one = matches!(range.trim(), "") || bracketed(range.trim()).is_some_and(is_range);
    (range_is_one && is_names(receivers)).then(|| {
        let (factor, offset) = (number(factor.trim()), number(offset.trim()));
        format!("{head}({factor},{offset}) [0|0] \"{unit}\" Vector__XXX")
    })
}

/// What is odd about a statement that the grammar takes as it is.
pub(super) fn oddity(text: &str) -> Option<String> {
    let (head, tail) = text.split_once(':')?;
    let mut words = head.split_ascii_whitespace().skip(1);
    let is_message = text.starts_with("BO_");
    let name = if is_message { words.nth(1)? } else { words.next()? };
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        return Some("the name begins with a digit".to_owned());
    }
    if is_message {
        return None;
    }
    if words.next().is_some() && !head.ends_with([' ', '\t']) {
        return Some("no blank between multiplexer mark and colon".to_owned());
    }
    let (_, scale) = tail.split_once('(')?;
    let (scale, _) = scale.split_once(')')?;
    let pointed = |number: &str| number.trim().trim_start_matches(['+', '-']).starts_with('.');
    scale.split(',').any(pointed).then(|| "a number begins with its decimal point".to_owned())
}

/// Whether the signal is marked as multiplexed without saying by which value.
pub(super) fn has_bare_multiplex_mark(text: &str) -> bool {
    let head = text.split(':').next().unwrap_or_default();
    head.split_ascii_whitespace().nth(2) == Some("m")
}

/// Whether an unreadable signal statement may have been a multiplexor's.
pub(super) fn may_be_multiplexor(text: &str) -> bool {
    let head = text.split(':').next().unwrap_or_default();
    head.split_ascii_whitespace().skip(2).any(|mark| mark.ends_with('M'))
}

/// `VAL_ id signal table ;` as message id, signal and table.
pub(super) fn table_reference(text: &str) -> Option<(u32, &str, &str)> {
    let mut words = text.strip_suffix(';')?.split_ascii_whitespace().skip(1);
    let reference = (words.next()?.parse().ok()?, words.next()?, words.next()?);
    words.next().is_none().then_some(reference)
}

fn bracketed(text: &str) -> Option<&str> {
    text.strip_prefix('[')?.strip_suffix(']')
}

fn is_range(text: &str) -> bool {
    text.chars().all(|c| c.is_ascii_alphanumeric() || " \t|+-.,#_".contains(c))
}

fn is_names(text: &str) -> bool {
    text.chars().all(|c| c.is_alphanumeric() || " \t,;_-.".contains(c))
}

/// `1.` and `1.e3` with the nought that the grammar asks for.
fn number(text: &str) -> String {
    let text = text.replace(".e", ".0e").replace(".E", ".0E");
    if text.ends_with('.') { text + "0" } else { text }
}
