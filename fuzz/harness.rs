//! What every target has in common: which panics end it, and what is left of an input that ends it without a word.

/// Puts a hook in the place of libFuzzer's that writes a line and lets the panic go on: one of a library that our readers catch is no
/// fault, and libFuzzer's own hook would end the target before. One that nobody catches still ends it.
pub fn let_panics_be_caught() {
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
}

/// Keeps the input that is tried now in the file that `FUZZ_LAST` names: what ends the target without a word (a stack that is full)
/// leaves no input behind.
pub fn keep_last(data: &[u8]) {
    static LAST: std::sync::OnceLock<Option<std::ffi::OsString>> = std::sync::OnceLock::new();
    if let Some(file) = LAST.get_or_init(|| std::env::var_os("FUZZ_LAST")) {
        std::fs::write(file, data).expect("the file of FUZZ_LAST can be written");
    }
}
