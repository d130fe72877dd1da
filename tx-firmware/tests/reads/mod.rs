//! The requests that read and change nothing.

use link::serial::Request;

pub const READS: [Request<'static>; 11] = [
    Request::Hello,
    Request::Status,
    Request::ReadTable { offset: 0 },
    Request::ReadCalibration,
    Request::ReadSymbolRate,
    Request::ReadIntensityLimit,
    Request::ReadCarrier,
    Request::ReadKey,
    Request::ReadSensor,
    Request::ReadLock,
    Request::ReadProgramHash,
];
