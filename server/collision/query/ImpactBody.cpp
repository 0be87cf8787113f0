#include "server/collision/query/ImpactBody.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

void set(float (&out)[9], const Mat3d& m) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) out[3 * row + column] = static_cast<float>(m(row, column));
}
void set(float (&out)[3], const Vec3d& v) {
    for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}

}  // namespace

kernel::MovingFrame ImpactBody::frame(const BodyMoment& m, double t, const Vec3d& origin, const Vec3d& drift,
                                      double sharedUnit, bool similarity) const {
    const double factor = sharedUnit / unit;
    kernel::MovingFrame f{};
    set(f.linear, m.linear * factor);
    set(f.translation, (m.place(centre) - origin) * sharedUnit);
    set(f.turning, m.turning * factor);
    set(f.drift, (m.velocity(centre) - drift) * sharedUnit);
    f.scale = 1;
    set(f.axes, m.linear * factor);
    if (similarity) {
        const double scale = std::abs(way.scaleAt(t)) * factor;
        f.scale = static_cast<float>(scale);
        set(f.axes, m.linear * (factor / scale));
    }
    f.stretch = roundedUp6(way.stretchAt(t) * factor);
    f.growth = roundedUp6(way.turn() * factor);
    f.swelling = roundedUp6(way.swelling() * factor);
    set(f.axis, way.axis());
    f.acceleration = way.carried() ? 0 : roundedUp6(way.acceleration(reach) * sharedUnit);
    return f;
}

}  // namespace tessera
