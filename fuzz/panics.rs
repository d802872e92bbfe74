//! A panic of a library that our readers catch is no fault: libFuzzer's own hook would end the target before it is caught. One that
//! nobody catches still ends it.

/// Puts a hook in the place of libFuzzer's that writes a line and lets the panic go on.
pub fn may_be_caught() {
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
}
