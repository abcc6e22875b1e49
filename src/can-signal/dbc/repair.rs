//! Repairs malformed statements that allow only one interpretation: errors in unused parts, or in notation.

/// Repairs a message statement whose sender, which is not used, is missing or not a name.
pub(super) fn message(text: &str) -> Option<String> {
    let (head, tail) = text.split_once(':')?;
    let tail = tail.trim_start();
    let size_end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
    let (size, sender) = tail.split_at(size_end);
    (is_names(sender) && (sender.is_empty() || sender.starts_with([' ', '\t', ';'])))
        .then(|| format!("{head}: {size} Vector__XXX"))
}

/// Repairs a signal statement with an unreadable range, irregular or missing receivers, which are not
/// used, or a number like `1.`.
pub(super) fn signal(text: &str) -> Option<String> {
    let (head, after_head) = text.split_once('(')?;
    let (scale, after_scale) = after_head.split_once(')')?;
    let (factor, offset) = scale.split_once(',')?;
    let (range, after_range) = after_scale.split_once('"').unwrap_or((after_scale, "\""));
    let (unit, receivers) = after_range.split_once('"')?;
    // Anything else here could be another signal on the same line.
    let range_is_valid = matches!(range.trim(), "") || bracketed(range.trim()).is_some_and(is_range);
    (range_is_valid && is_names(receivers)).then(|| {
        let (factor, offset) = (number(factor.trim()), number(offset.trim()));
        format!("{head}({factor},{offset}) [0|0] \"{unit}\" Vector__XXX")
    })
}

/// Returns the irregularity of a statement that the grammar accepts; `None` for a regular one.
pub(super) fn irregularity(text: &str) -> Option<String> {
    let (head, tail) = text.split_once(':')?;
    let mut fields = head.split_ascii_whitespace().skip(1);
    let is_message = text.starts_with("BO_");
    let name = if is_message { fields.nth(1)? } else { fields.next()? };
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        return Some("the name begins with a digit".to_owned());
    }
    if is_message {
        return None;
    }
    if fields.next().is_some() && !head.ends_with([' ', '\t']) {
        return Some("no space between the multiplexer indicator and the colon".to_owned());
    }
    let (_, scale) = tail.split_once('(')?;
    let (scale, _) = scale.split_once(')')?;
    let pointed = |number: &str| number.trim().trim_start_matches(['+', '-']).starts_with('.');
    scale.split(',').any(pointed).then(|| "a number begins with its decimal point".to_owned())
}

/// Returns true if the signal is marked as multiplexed without a value.
pub(super) fn has_bare_multiplex_mark(text: &str) -> bool {
    let head = text.split(':').next().unwrap_or_default();
    head.split_ascii_whitespace().nth(2) == Some("m")
}

/// Returns true if an unreadable signal statement may define a multiplexor.
pub(super) fn may_be_multiplexor(text: &str) -> bool {
    let head = text.split(':').next().unwrap_or_default();
    head.split_ascii_whitespace().skip(2).any(|mark| mark.ends_with('M'))
}

/// Splits `VAL_ id signal table ;` into message id, signal and table; `None` for any other form.
pub(super) fn table_reference(text: &str) -> Option<(u32, &str, &str)> {
    let mut fields = text.strip_suffix(';')?.split_ascii_whitespace().skip(1);
    let reference = (fields.next()?.parse().ok()?, fields.next()?, fields.next()?);
    fields.next().is_none().then_some(reference)
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

/// Adds the zero that the grammar requires in `1.` and `1.e3`.
fn number(text: &str) -> String {
    let text = text.replace(".e", ".0e").replace(".E", ".0E");
    if text.ends_with('.') { text + "0" } else { text }
}
