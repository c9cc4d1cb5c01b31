"""Bayesian neural Kalman tracking for radar nodes: the firmware's own code, the same bits.

Frame and units everywhere: x east, y north, z up, the radar at the origin unless a measurement says otherwise;
azimuth from +x towards +y, elevation from the horizontal, range-rate positive outbound; metres, radians, metres per
second, times in microseconds. Numbers are float32 inside; float64 that come in are rounded to the nearest.
"""

import os
from collections.abc import Sequence
from typing import Final, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "COLUMNS",
    "BnkfError",
    "Doubt",
    "Estimate",
    "Estimates",
    "Likelihood",
    "Model",
    "ModelError",
    "SettingsError",
    "StepError",
    "TrackBytesError",
    "Tracker",
    "track",
    "__version__",
]

_Channel = tuple[float, float] | None
_Inference = Literal["mean", "moments"] | int | None
_Correction = Literal["none", "converted", "polar"] | None
_Three = Sequence[float] | NDArray[np.floating] | None

__version__: str
COLUMNS: Final[tuple[str, ...]]
"""Columns of readings in order, with their units: as `host-sim readings` names them."""

class BnkfError(ValueError):
    """What the tracker refuses; the text says what and why."""

class ModelError(BnkfError):
    """The bytes are no model that this version runs."""

class SettingsError(BnkfError):
    """A setting that does not exist, or does not fit the model."""

class StepError(BnkfError):
    """A step, coast, forecast or likelihood that was refused; the tracker is as before."""

class TrackBytesError(BnkfError):
    """The bytes are no track, or one of another kind than the model."""

@final
class Model:
    """A checked model; any number of trackers share it."""

    def __new__(cls, source: bytes | str | os.PathLike[str]) -> Model:
        """The bytes of a `.bnkf` file, or its path. Raises ModelError, OSError."""

    @property
    def kind(self) -> Literal["recursive", "memoryless"]: ...
    @property
    def checksum(self) -> int:
        """CRC-32 of its bytes, by which a track knows it."""

    @property
    def passes(self) -> int:
        """Monte Carlo passes that it asks for; 1 is mean weights."""

@final
class Doubt:
    """How probable it is that the target or the sensor did what the model does not expect of them."""

    @property
    def manoeuvre(self) -> float:
        """Probability that the target manoeuvred."""

    @property
    def outlier(self) -> float:
        """Probability that the reading is wrong; one if it was rejected."""

@final
class Estimate:
    """Position and covariance at one instant; x east, y north, z up. Arrays are float32."""

    @property
    def time_us(self) -> int:
        """Time, microseconds, of the measurement, coast or forecast."""

    @property
    def position_m(self) -> NDArray[np.float32]:
        """Position, m; shape (3,)."""

    @property
    def covariance_m2(self) -> NDArray[np.float32]:
        """Covariance of the position, m^2; shape (3, 3), positive definite."""

    @property
    def velocity_mps(self) -> NDArray[np.float32] | None:
        """Velocity, m/s; shape (3,), or None of a memoryless model."""

    @property
    def acceleration_mps2(self) -> NDArray[np.float32] | None:
        """Acceleration, m/s^2; shape (3,), or None of a memoryless model."""

    @property
    def covariance(self) -> NDArray[np.float32] | None:
        """Covariance of position, velocity and acceleration, three rows each; shape (9, 9), or None."""

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the correction; zero without one."""

    @property
    def mode(self) -> Literal["started", "tracking", "coasting", "rejected", "restarted"]: ...
    @property
    def outside(self) -> bool:
        """Whether the target is where, or moves as, the model was not trained for."""

    @property
    def doubt(self) -> Doubt:
        """What the measurement says against the model."""

@final
class Likelihood:
    """What a track says of a measurement, for associating plots with tracks."""

    @property
    def innovation(self) -> NDArray[np.float32]:
        """Measured less expected: elevation, azimuth (rad), range (m), range-rate (m/s); NaN where there is none."""

    @property
    def nis(self) -> float:
        """Normalised innovation squared."""

    @property
    def degrees(self) -> int:
        """Degrees of freedom of the NIS."""

    @property
    def ln_likelihood(self) -> float:
        """Natural logarithm of the density, per rad^2 m m/s or what is there of them."""

    @property
    def passes_gate(self) -> bool:
        """Whether the gate would pass the measurement."""

@final
class Tracker:
    """Estimates the position of one target from its radar measurements."""

    def __new__(
        cls,
        model: Model,
        inference: _Inference = None,
        *,
        frozen_spreads: bool = False,
        correction: _Correction = None,
        seed: int = 1,
    ) -> Tracker:
        """inference: None for the model's own, "mean", "moments", or a number of passes. Raises SettingsError."""

    def step(
        self,
        time_us: int,
        range: _Channel = None,
        elevation: _Channel = None,
        azimuth: _Channel = None,
        range_rate: _Channel = None,
        sensor_position_m: _Three = None,
        sensor_velocity_mps: _Three = None,
    ) -> Estimate:
        """The estimate at the time of a measurement. A channel is (value, sigma): m, rad, rad, m/s. Raises StepError."""

    def coast(self, time_us: int) -> Estimate:
        """The estimate at a time without a measurement; the covariance grows. Raises StepError."""

    def forecast(self, times_us: Sequence[int] | NDArray[np.integer]) -> list[Estimate]:
        """Where the target will be at times that lie in order; the track stays as it is. Raises StepError."""

    def likelihood(
        self,
        time_us: int,
        range: _Channel = None,
        elevation: _Channel = None,
        azimuth: _Channel = None,
        range_rate: _Channel = None,
        sensor_position_m: _Three = None,
        sensor_velocity_mps: _Three = None,
    ) -> Likelihood:
        """How well a measurement fits the track, which stays as it is. Raises StepError."""

    def reset(self) -> None:
        """Forgets the target and all times, and starts the random stream again."""

    @property
    def latest_us(self) -> int | None:
        """Time of the latest step or coast, microseconds."""

    def to_bytes(self) -> bytes:
        """All that is known of the target, to the bit: what the firmware writes."""

    @staticmethod
    def from_bytes(model: Model, data: bytes) -> Tracker:
        """Goes on with what to_bytes, or a microcontroller, wrote. Raises TrackBytesError."""

@final
class Estimates:
    """What a tracker said to each of a flight's readings: a row each. NaN in rows that were refused."""

    def __len__(self) -> int: ...
    @property
    def time_us(self) -> NDArray[np.uint64]:
        """Times, microseconds; shape (n,)."""

    @property
    def position_m(self) -> NDArray[np.float32]:
        """Positions, m; shape (n, 3)."""

    @property
    def covariance_m2(self) -> NDArray[np.float32]:
        """Their covariances, m^2; shape (n, 3, 3)."""

    @property
    def velocity_mps(self) -> NDArray[np.float32]:
        """Velocities, m/s; shape (n, 3), NaN of a memoryless model."""

    @property
    def nis(self) -> NDArray[np.float32]:
        """Normalised innovations squared; shape (n,), zero without a correction."""

    @property
    def mode(self) -> NDArray[np.str_]:
        """How they came about, as Estimate.mode says, or "refused"; shape (n,)."""

    @property
    def outside(self) -> NDArray[np.bool_]:
        """Whether the target is where, or moves as, the model was not trained for; shape (n,)."""

    @property
    def manoeuvre(self) -> NDArray[np.float32]:
        """Probabilities that the target manoeuvred; shape (n,)."""

    @property
    def outlier(self) -> NDArray[np.float32]:
        """Probabilities that the reading is wrong; shape (n,)."""

    @property
    def refused(self) -> dict[int, str]:
        """Why readings were refused, by their row."""

def track(
    model: Model,
    readings: ArrayLike,
    inference: _Inference = None,
    *,
    frozen_spreads: bool = False,
    correction: _Correction = None,
    seed: int = 1,
) -> Estimates:
    """Tracks a whole flight without holding the interpreter's lock.

    readings: an array of shape (n, 9) or (n, 15) whose columns are COLUMNS, or a structured one or a data frame with
    columns of these names. NaN was not measured; a row without a channel asks for an estimate in a gap. Rows that the tracker refuses are
    named in `refused`, and it goes on. Raises SettingsError, ValueError.
    """
