"""Stone Soup's EKF and UKF: straight flight with white acceleration, the same with a velocity that fades, or Singer's model.

tests/golden/stonesoup_filters.py says why these are not Stone Soup's defaults: the EKF's covariance is made symmetric, the
UKF has alpha = 1 and kappa = 0, elevations are of type Bearing.
"""

import datetime

import numpy as np
from stonesoup.models.measurement.nonlinear import CartesianToElevationBearingRangeRate
from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity, OrnsteinUhlenbeck, Singer
from stonesoup.predictor.kalman import ExtendedKalmanPredictor, UnscentedKalmanPredictor
from stonesoup.types.angle import Bearing
from stonesoup.types.array import StateVector
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import ExtendedKalmanUpdater, UnscentedKalmanUpdater

WHAT = "straight flight with q (m^2/s^3), with a velocity that fades besides (1/s), or Singer's model with the acceleration's sd (m/s^2) and its rate (1/s):"
GRID = [("straight", 0.2), ("straight", 0.7), ("fading", 0.5, 0.1), ("fading", 1.0, 0.3), ("fading", 2.0, 0.6), ("Singer", 1.3, 0.7)]
START = datetime.datetime(2020, 1, 1)


class Radar(CartesianToElevationBearingRangeRate):
    @staticmethod
    def _typed_vector():
        return np.array([[Bearing(0)], [Bearing(0)], [0.0], [0.0]])


def track(kind, setting, begin, t, z, sigma, there):
    """Yields position and covariance after every sample."""
    mean, covariance = begin
    name, *figures = setting
    if name == "Singer":
        size, model = 3, Singer(2 * figures[0] ** 2 * figures[1], figures[1])
    else:
        size, model = 2, {"straight": ConstantVelocity, "fading": OrnsteinUhlenbeck}[name](*figures)
    motion = CombinedLinearGaussianTransitionModel([model] * 3)
    places = [size * axis for axis in range(3)]
    both = places + [place + 1 for place in places]
    state, spread = np.zeros(3 * size), np.zeros((3 * size, 3 * size))
    state[both], spread[np.ix_(both, both)] = mean, covariance
    if size == 3:
        spread[[2, 5, 8], [2, 5, 8]] = figures[0] ** 2
    sr, se, sa, sd = sigma[0]
    sensor = Radar(ndim_state=3 * size, mapping=places, velocity_mapping=[p + 1 for p in places], noise_covar=np.diag([se, sa, sr, sd]) ** 2)
    if kind == "ekf":
        predictor, updater = ExtendedKalmanPredictor(motion), ExtendedKalmanUpdater(sensor, force_symmetric_covariance=True)
    else:
        points = {"alpha": 1.0, "beta": 2.0, "kappa": 0.0}
        predictor, updater = UnscentedKalmanPredictor(motion, **points), UnscentedKalmanUpdater(sensor, **points)
    belief = GaussianState(StateVector(state), spread, timestamp=START)
    yield mean[:3], covariance[:3, :3]
    for seconds, (r, el, az, rate), seen in zip(t[1:], z[1:], there[1:]):
        now = START + datetime.timedelta(seconds=float(seconds - t[0]))
        belief = predictor.predict(belief, timestamp=now)
        if seen:
            vector = StateVector([Bearing(el), Bearing(az), r, rate])
            detection = Detection(vector, timestamp=now, measurement_model=sensor)
            belief = updater.update(SingleHypothesis(belief, detection))
        yield np.asarray(belief.state_vector, float).ravel()[places], np.asarray(belief.covar, float)[np.ix_(places, places)]
