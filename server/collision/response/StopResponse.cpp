#include "server/collision/response/FreeWay.h"

namespace tessera {

namespace {

class StopResponse final : public Response {
public:
    [[nodiscard]] Resolution resolve(const MotionTrial& trial) const override {
        const FreeWay way = freeWay(trial, 1);
        Resolution resolution;
        resolution.accepted = trial.way().at(way.reached);
        resolution.stopped = way.reached < 1;
        if (resolution.stopped && leadsNowhere(trial, way.by, resolution.accepted))
            resolution.accepted = trial.way().start;
        resolution.undecided = way.undecided;
        if (resolution.stopped) resolution.hits = hitsOf(trial, way);
        return resolution;
    }
};

}  // namespace

std::unique_ptr<Response> makeStopResponse() {
    return std::make_unique<StopResponse>();
}

}  // namespace tessera
