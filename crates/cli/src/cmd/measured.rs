//! How loose clouds were measured: flags of the commands that take clouds.

use clap::Args;
use scene::Area;
use std::path::PathBuf;
use tsumu::Clouds;

/// How a loose cloud was measured.
#[derive(Clone, Debug, Args)]
pub struct Measured {
    /// Kind of sensor; with a depth camera the bin's floor is removed first
    #[arg(long, value_enum, default_value_t = Sensor::Uav)]
    pub sensor: Sensor,
    /// Where the sensor was, in the cloud's coordinates; repeat it for several places [default: straight above]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub sensor_position: Vec<[f64; 3]>,
    /// Read only what lies in this rectangle, in the cloud's coordinates; a COPC only where it touches it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = rectangle, allow_hyphen_values = true)]
    pub area: Option<Area>,
}

impl Measured {
    /// The clouds as the library takes them.
    pub fn clouds(&self, files: &[PathBuf]) -> Clouds {
        Clouds {
            files: files.to_vec(),
            sensor: self.sensor.kind(),
            sensor_positions: self.sensor_position.clone(),
            area: self.area,
        }
    }
}

/// Kinds of sensor on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Sensor {
    /// Photogrammetry or laser from the air
    Uav,
    /// Multibeam sonar
    Mbes,
    /// Depth camera above a bin
    DepthCamera,
}

impl Sensor {
    /// The program's word.
    pub fn kind(self) -> scene::SensorKind {
        match self {
            Self::Uav => scene::SensorKind::Uav,
            Self::Mbes => scene::SensorKind::Mbes,
            Self::DepthCamera => scene::SensorKind::DepthCamera,
        }
    }
}

/// `x,y,z` as three numbers.
pub fn point(text: &str) -> Result<[f64; 3], String> {
    <[f64; 3]>::try_from(numbers(text)?)
        .map_err(|n| format!("{} numbers instead of x,y,z", n.len()))
}

/// `x0,y0,x1,y1` as a rectangle.
fn rectangle(text: &str) -> Result<Area, String> {
    let [west, south, east, north] = <[f64; 4]>::try_from(numbers(text)?)
        .map_err(|n| format!("{} numbers instead of x0,y0,x1,y1", n.len()))?;
    let area = Area { west, east, south, north };
    area.check().map_err(|e| e.to_string())?;
    Ok(area)
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|t| t.trim().parse::<f64>())
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}
