//! A panic of a library that our readers catch is no fault: libFuzzer's own hook would end the target before it is caught. One that
//! nobody catches still ends it.

/// Puts a hook in the place of libFuzzer's that writes a line and lets the panic go on.
pub fn may_be_caught() {
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
}

/// Keeps the input that is tried now in the file that `FUZZ_LAST` names: what ends the target without a word (a stack that is full)
/// leaves no input behind.
pub fn keep(data: &[u8]) {
    static LAST: std::sync::OnceLock<Option<std::ffi::OsString>> = std::sync::OnceLock::new();
    if let Some(file) = LAST.get_or_init(|| std::env::var_os("FUZZ_LAST")) {
        std::fs::write(file, data).expect("the file of FUZZ_LAST can be written");
    }
}
