//! Where a training computes: the processor, or a graphics card through Vulkan when the program is built with `gpu`.

use burn::tensor::Device;

/// A place for tensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// The processor, with the fused pooling.
    #[default]
    Cpu,
    /// The first graphics card, by tensor operations.
    Gpu,
}

/// No graphics card can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProcessorError {
    /// Built without it.
    #[error(
        "this program was built without graphics cards; build it with `--features gpu`, or leave --gpu away"
    )]
    NotBuilt,
    /// None answers.
    #[error("no graphics card answers through Vulkan: {0}; is its driver installed?")]
    NoCard(String),
}

impl Processor {
    /// Its device, after it has done a sum: the library panics where there is no card.
    pub fn device(self) -> Result<Device, ProcessorError> {
        match self {
            Self::Cpu => Ok(Device::flex()),
            Self::Gpu => gpu(),
        }
    }
}

#[cfg(feature = "gpu")]
fn gpu() -> Result<Device, ProcessorError> {
    use burn::tensor::{DeviceKind, Tensor};
    let probe = || {
        let device = Device::vulkan(DeviceKind::DefaultDevice);
        let sum = crate::floats(Tensor::<1>::from_floats([1.0, 2.0], &device).sum());
        (device, sum[0])
    };
    let said = |cause: Box<dyn std::any::Any + Send>| {
        let text = cause
            .downcast_ref::<String>()
            .map(String::as_str)
            .or(cause.downcast_ref::<&str>().copied());
        ProcessorError::NoCard(
            text.unwrap_or("it gave no reason").lines().next().unwrap_or_default().to_owned(),
        )
    };
    match std::panic::catch_unwind(probe) {
        Ok((device, 3.0)) => Ok(device),
        Ok((_, sum)) => Err(ProcessorError::NoCard(format!("it says that 1 + 2 = {sum}"))),
        Err(cause) => Err(said(cause)),
    }
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Device, ProcessorError> {
    Err(ProcessorError::NotBuilt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_always_there() {
        assert!(Processor::Cpu.device().is_ok());
    }

    #[cfg(not(feature = "gpu"))]
    #[test]
    fn a_program_without_graphics_says_so() {
        assert_eq!(Processor::Gpu.device().unwrap_err(), ProcessorError::NotBuilt);
    }
}
