#include "server/import/coin/CoinMotion.h"

#include <Inventor/VRMLnodes/SoVRMLColorInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinateInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLMaterial.h>
#include <Inventor/VRMLnodes/SoVRMLOrientationInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLPositionInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLScalarInterpolator.h>
#include <Inventor/VRMLnodes/SoVRMLTimeSensor.h>
#include <Inventor/VRMLnodes/SoVRMLViewpoint.h>
#include <Inventor/engines/SoEngine.h>
#include <Inventor/engines/SoEngineOutput.h>
#include <Inventor/engines/SoNodeEngine.h>
#include <Inventor/lists/SoFieldList.h>
#include <Inventor/misc/SoProtoInstance.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <span>

#include "common/base/Utf8.h"
#include "common/math/Srgb.h"
#include "common/math/Types.h"
#include "server/import/reader/MovingParts.h"

namespace tessera {
namespace {

constexpr int kMostInterfaces = 64;

bool isInterface(const SoFieldContainer* container) {
    return container != nullptr && container->isOfType(SoProtoInstance::getClassTypeId());
}

/// Where a field gets its value from through the interfaces of prototypes: itself, where it has one of its own.
SoField& sourceOf(SoField& field) {
    SoField* source = &field;
    for (int i = 0; i < kMostInterfaces; ++i) {
        // A route counts beside an IS, which may lead to nothing.
        if (SoEngineOutput* output = nullptr; source->getConnectedEngine(output) && output != nullptr) break;
        SoField* master = nullptr;
        if (!source->getConnectedField(master) || master == nullptr || !isInterface(master->getContainer())) break;
        source = master;
    }
    return *source;
}

/// Who drives a field, or nobody.
SoNodeEngine* driverOf(SoField& field) {
    SoEngineOutput* output = nullptr;
    const SoField& source = sourceOf(field);
    if (!source.getConnectedEngine(output) || output == nullptr || !output->isNodeEngineOutput()) return nullptr;
    return output->getNodeContainer();
}

/// The fields of nodes that get the values of these ones, through the interfaces of prototypes.
std::vector<SoField*> fieldsBehind(const SoFieldList& fields, int interfaces = 0) {
    std::vector<SoField*> behind;
    for (int i = 0; i < fields.getLength(); ++i) {
        SoField* const field = fields[i];
        const SoFieldContainer* const container = field->getContainer();
        if (isInterface(container) && interfaces < kMostInterfaces) {
            SoFieldList further;
            field->getForwardConnections(further);
            const std::vector<SoField*> all = fieldsBehind(further, interfaces + 1);
            behind.insert(behind.end(), all.begin(), all.end());
        } else if (container != nullptr && container->isOfType(SoNode::getClassTypeId())) {
            behind.push_back(field);
        }
    }
    return behind;
}

/// Whether it runs by itself now (ISO/IEC 14772-1:1997, 4.6.9). A stopTime that is not behind startTime is none.
bool runs(const SoVRMLTimeSensor& sensor) {
    if (!sensor.loop.getValue() || !sensor.enabled.getValue()) return false;
    const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    const double start = sensor.startTime.getValue().getValue(), stop = sensor.stopTime.getValue().getValue();
    return !(start > now) && !(stop > start && stop <= now);
}

/// "Viewpoint"
std::string wordOf(const SoNode& node) {
    const std::string name = node.getTypeId().getName().getString();
    return name.starts_with("VRML") ? name.substr(4) : name;
}

void appendRotation(std::vector<double>& values, const SbRotation& rotation) {
    float x = 0, y = 0, z = 0, w = 1;
    rotation.getValue(x, y, z, w);
    values.insert(values.end(), {w, x, y, z});
}

/// As Animations are between two keys: on a straight line, or along the shorter arc.
std::vector<double> between(std::span<const double> a, std::span<const double> b, double share, bool turns) {
    if (turns) {
        const Quatd way = Quatd(a[0], a[1], a[2], a[3]).slerp(share, Quatd(b[0], b[1], b[2], b[3]));
        return {way.w(), way.x(), way.y(), way.z()};
    }
    std::vector<double> all;
    for (std::size_t c = 0; c < a.size(); ++c) all.push_back(a[c] + share * (b[c] - a[c]));
    return all;
}

/// Whether another one drives it, too: Coin hears the last one alone.
bool hasFurtherDriver(SoField& field) {
    SoField& source = sourceOf(field);
    SoEngineOutput *last = nullptr, *further = nullptr;
    if (!source.getConnectedEngine(last) || last == nullptr) return false;
    // The connection may be all that holds it.
    SoFieldContainer* const engine =
        last->isNodeEngineOutput() ? static_cast<SoFieldContainer*>(last->getNodeContainer()) : last->getContainer();
    engine->ref();
    source.disconnect(last);
    const bool has = source.getConnectedEngine(further) && further != nullptr;
    source.appendConnection(last, TRUE);
    source.enableConnection(FALSE);
    engine->unrefNoDelete();
    return has;
}

/// Whether it follows the field of another node, which an interpolator moves.
bool followsMovingField(SoField& field) {
    SoField* source = &sourceOf(field);
    for (int i = 0; i < kMostInterfaces; ++i) {
        SoField* master = nullptr;
        if (!source->getConnectedField(master) || master == nullptr) return false;
        source = &sourceOf(*master);
        if (const SoNodeEngine* const driver = driverOf(*source))
            return driver->isOfType(SoVRMLInterpolator::getClassTypeId());
    }
    return false;
}

}  // namespace

std::string nameOf(const SoNode& node) {
    std::string name = node.getName().getString();
    const bool isOurs = isUtf8(name);
    for (char& c : name) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '/' || byte < 0x20 || byte == 0x7f || (!isOurs && byte >= 0x80)) c = '_';
    }
    return std::string(cutUtf8(name, kLongestName));
}

bool CoinMotion::hold(SoNode& node) {
    if (!held_.insert(&node).second) return routes_.contains(&node);
    if (node.isOfType(SoVRMLInterpolator::getClassTypeId()))
        interpolators_.push_back(static_cast<SoVRMLInterpolator*>(&node));
    SoFieldList fields;
    const int count = node.getFields(fields);
    for (int i = 0; i < count; ++i) {
        SoField& field = *fields[i];
        if (!field.isConnected()) continue;
        SbName name;
        node.getFieldName(&field, name);
        SoNodeEngine* const driver = driverOf(field);
        if (driver == nullptr && followsMovingField(field))
            notes_.add(fmt::format("{} of a {} stands still: a route from another node's field is not followed",
                                   name.getString(), wordOf(node)),
                       nameOf(node));
        // Before anybody reads it: what it is driven to now is not what the file says.
        if (SoField& source = sourceOf(field); source.isConnected()) source.enableConnection(FALSE);
        if (driver == nullptr || !driver->isOfType(SoVRMLInterpolator::getClassTypeId())) {
            if (driver != nullptr)
                notes_.add(fmt::format("left out: a route to {}, which comes from no interpolator", name.getString()),
                           nameOf(node));
            continue;
        }
        if (hasFurtherDriver(field))
            notes_.add(fmt::format("of several interpolators that move one {} the last one does", name.getString()),
                       nameOf(node));
        auto* interpolator = static_cast<SoVRMLInterpolator*>(driver);
        SoNodeEngine* const clock = driverOf(interpolator->set_fraction);
        if (clock == nullptr || !clock->isOfType(SoVRMLTimeSensor::getClassTypeId())) {
            notes_.add("an interpolator moves nothing: no TimeSensor drives it", nameOf(*interpolator));
            continue;
        }
        if (!routes_.contains(&node)) moving_.push_back(&node);
        if (used_.insert(interpolator).second && hasFurtherDriver(interpolator->set_fraction))
            notes_.add("of several TimeSensors that drive one interpolator the last one does", nameOf(*interpolator));
        routes_[&node].push_back({interpolator, static_cast<SoVRMLTimeSensor*>(clock), name.getString()});
    }
    return routes_.contains(&node);
}

const CoinMotion::Route* CoinMotion::routeTo(const SoNode& node, std::string_view field) const {
    const auto routes = routes_.find(&node);
    if (routes == routes_.end()) return nullptr;
    const auto route = std::ranges::find(routes->second, field, &Route::field);
    return route == routes->second.end() ? nullptr : &*route;
}

bool CoinMotion::drives(const SoNode& node, std::string_view field) const {
    return routeTo(node, field) != nullptr;
}

const SoVRMLCoordinateInterpolator* CoinMotion::pointsOf(const SoNode& coordinate) const {
    const Route* const route = routeTo(coordinate, "point");
    return route != nullptr && route->interpolator->isOfType(SoVRMLCoordinateInterpolator::getClassTypeId())
               ? static_cast<const SoVRMLCoordinateInterpolator*>(route->interpolator)
               : nullptr;
}

std::optional<CoinMotion::Track> CoinMotion::weightsOf(const SoNode& coordinate, std::size_t targets,
                                                       const std::vector<double>& weights) {
    const Route* const route = routeTo(coordinate, "point");
    if (route == nullptr) return std::nullopt;
    const std::optional<Keys> keys = keysOf(*route, false, targets, weights);
    return keys ? std::optional(trackOf(*route, "weights", *keys, {})) : std::nullopt;
}

void CoinMotion::addTarget(const Track& track, proto::scene::Node& message) {
    proto::scene::Channel channel = track.channel;
    channel.set_target_key(keyOf(message));
    add(track.sensor, std::move(channel));
}

std::uint32_t CoinMotion::keyOf(proto::scene::Node& message) {
    if (message.key() == 0) message.set_key(++lastKey_);
    return message.key();
}

void CoinMotion::addTarget(const SoNode& node, proto::scene::Node& message) {
    const auto routes = routes_.find(&node);
    if (routes == routes_.end()) return;
    told_.insert(&node);
    const bool isView = node.isOfType(SoVRMLViewpoint::getClassTypeId());
    for (const Route& route : routes->second) {
        std::size_t width = 0;
        const std::vector<double> values = valuesOf(route, width);
        proto::scene::Channel channel;
        channel.set_target_key(keyOf(message));
        std::string field = route.field;
        if (isView && field == "position") field = "translation";
        if (isView && field == "orientation") field = "rotation";
        const bool centred = message.has_component_transform();
        const bool known =
            ((field == "translation" || field == "scale" || (centred && field == "center")) && width == 3) ||
            ((field == "rotation" || (centred && field == "scaleOrientation")) && width == 4) ||
            (field == "intensity" && width == 1);
        if (!known) {
            standStill(node, route.field);
            continue;
        }
        addChannel(route, field, width, values, std::move(channel));
    }
}

void CoinMotion::addMaterial(const SoNode& node, const proto::scene::Material& material, Counted diffuse,
                             Counted emissive) {
    const auto routes = routes_.find(&node);
    if (routes == routes_.end()) return;
    told_.insert(&node);
    const Route *color = nullptr, *opacity = nullptr;
    for (const Route& route : routes->second) {
        std::size_t width = 0;
        std::vector<double> values = valuesOf(route, width);
        if ((route.field == "diffuseColor" || route.field == "emissiveColor") && width == 3) {
            const Counted counted = route.field == "diffuseColor" ? diffuse : emissive;
            if (counted == Counted::kAsBase) color = &route;
            if (counted != Counted::kAsGlow) continue;
            for (double& value : values) value = linearOfSrgb(value);
            proto::scene::Channel channel;
            channel.set_material(material.name());
            addChannel(route, "emissive", 3, values, std::move(channel));
        } else if (route.field == "transparency" && width == 1) {
            opacity = &route;
        } else {
            standStill(node, route.field);
        }
    }
    addBaseColor(node, material, color, opacity);
}

/// Both are one field here, and so of one track.
void CoinMotion::addBaseColor(const SoNode& node, const proto::scene::Material& material, const Route* color,
                              const Route* opacity) {
    std::size_t width = 0;
    std::optional<Keys> colors, opacities;
    if (color != nullptr) {
        std::vector<double> values = valuesOf(*color, width);
        for (double& value : values) value = linearOfSrgb(value);
        colors = keysOf(*color, false, 3, values);
    }
    if (opacity != nullptr) {
        std::vector<double> values = valuesOf(*opacity, width);
        for (double& value : values) value = std::clamp(1 - value, 0.0, 1.0);
        opacities = keysOf(*opacity, false, 1, values);
    }
    if (colors && opacities && color->sensor != opacity->sensor) {
        notes_.add("the transparency of a material stands still: another TimeSensor moves its colour", nameOf(node));
        opacities.reset();
    }
    if (!colors && !opacities) return;
    const Route& route = colors ? *color : *opacity;
    const proto::scene::Color& base = material.base_color();
    if (!colors) colors = Keys{{0}, {base.r(), base.g(), base.b()}};
    if (!opacities) opacities = Keys{{0}, {base.a()}};
    Keys joined;
    std::ranges::set_union(colors->times, opacities->times, std::back_inserter(joined.times));
    if (joined.times.size() > kMaxKeysPerChannel) {
        notes_.add("the colours and transparencies of a material have more than a million keys: they stand still",
                   nameOf(node));
        return;
    }
    for (const double time : joined.times) {
        const std::vector<double> rgb = colors->at(time, 3), a = opacities->at(time, 1);
        joined.values.insert(joined.values.end(), rgb.begin(), rgb.end());
        joined.values.push_back(a.front());
    }
    proto::scene::Channel channel;
    channel.set_material(material.name());
    Track track = trackOf(route, "baseColor", joined, std::move(channel));
    add(track.sensor, std::move(track.channel));
}

std::vector<double> CoinMotion::Keys::at(double time, std::size_t width) const {
    const auto row = [&](std::size_t k) { return std::span(values).subspan(k * width, width); };
    const auto next = static_cast<std::size_t>(std::ranges::upper_bound(times, time) - times.begin());
    if (next == 0 || next == times.size()) {
        const auto end = row(next == 0 ? 0 : next - 1);
        return {end.begin(), end.end()};
    }
    return between(row(next - 1), row(next), (time - times[next - 1]) / (times[next] - times[next - 1]), false);
}

void CoinMotion::leaveOut(const SoNode& node) {
    const auto routes = routes_.find(&node);
    if (routes == routes_.end() || !told_.insert(&node).second) return;
    for (const Route& route : routes->second) standStill(node, route.field);
}

void CoinMotion::standStill(const SoNode& node, std::string_view field) {
    notes_.add(fmt::format("{} of a {} stands still: it cannot be animated here", field, wordOf(node)), nameOf(node));
}

/// No motion of the file is lost without a note.
void CoinMotion::noteLost() {
    for (const SoNode* const node : moving_) leaveOut(*node);
    // Coin itself drops routes whose kinds differ, and those within a prototype to another one's interface, without a
    // word.
    for (SoVRMLInterpolator* const interpolator : interpolators_) {
        const SoNodeEngine* const clock = driverOf(interpolator->set_fraction);
        SoEngineOutput* const output = interpolator->getOutput("value_changed");
        if (clock == nullptr || output == nullptr) continue;
        SoFieldList driven;
        output->getForwardConnections(driven);
        const std::vector<SoField*> fields = fieldsBehind(driven);
        if (fields.empty() && !used_.contains(interpolator))
            notes_.add("an interpolator moves nothing: no field of a known node takes its values",
                       nameOf(*interpolator));
        for (SoField* const field : fields) {
            auto* const node = static_cast<SoNode*>(field->getContainer());
            if (held_.contains(node)) continue;  // its routes are known
            SbName name;
            node->getFieldName(field, name);
            standStill(*node, name.getString());
        }
    }
}

std::vector<double> CoinMotion::valuesOf(const Route& route, std::size_t& width) const {
    SoVRMLInterpolator& by = *route.interpolator;
    std::vector<double> values;
    if (by.isOfType(SoVRMLPositionInterpolator::getClassTypeId())) {
        width = 3;
        const SoMFVec3f& all = static_cast<SoVRMLPositionInterpolator&>(by).keyValue;
        for (int i = 0; i < all.getNum(); ++i)
            for (int c = 0; c < 3; ++c) values.push_back(all[i][c]);
    } else if (by.isOfType(SoVRMLColorInterpolator::getClassTypeId())) {
        width = 3;
        const SoMFColor& all = static_cast<SoVRMLColorInterpolator&>(by).keyValue;
        for (int i = 0; i < all.getNum(); ++i)
            for (int c = 0; c < 3; ++c) values.push_back(std::clamp(double{all[i][c]}, 0.0, 1.0));
    } else if (by.isOfType(SoVRMLOrientationInterpolator::getClassTypeId())) {
        width = 4;
        const SoMFRotation& all = static_cast<SoVRMLOrientationInterpolator&>(by).keyValue;
        for (int i = 0; i < all.getNum(); ++i) appendRotation(values, all[i]);
    } else if (by.isOfType(SoVRMLScalarInterpolator::getClassTypeId())) {
        width = 1;
        const SoMFFloat& all = static_cast<SoVRMLScalarInterpolator&>(by).keyValue;
        for (int i = 0; i < all.getNum(); ++i) values.push_back(all[i]);
    }
    return values;
}

void CoinMotion::addChannel(const Route& route, const std::string& field, std::size_t width,
                            const std::vector<double>& values, proto::scene::Channel channel) {
    const bool turns = width == 4 && (field == "rotation" || field == "scaleOrientation");
    const std::optional<Keys> keys = keysOf(route, turns, width, values);
    if (!keys) return;
    Track track = trackOf(route, field, *keys, std::move(channel));
    add(track.sensor, std::move(track.channel));
}

CoinMotion::Track CoinMotion::trackOf(const Route& route, const std::string& field, const Keys& keys,
                                      proto::scene::Channel channel) {
    channel.set_field(field);
    channel.set_times_blob(scene_.addBlob(bytesOfNumbers(keys.times)));
    channel.set_values_blob(scene_.addBlob(bytesOfNumbers(keys.values)));
    return {std::move(channel), route.sensor};
}

std::optional<CoinMotion::Keys> CoinMotion::keysOf(const Route& route, bool turns, std::size_t width,
                                                   const std::vector<double>& values) {
    const auto what = [&](const char* why) {
        notes_.add(fmt::format("an interpolator moves nothing: {}", why), nameOf(*route.interpolator));
        return std::nullopt;
    };
    const SoMFFloat& key = route.interpolator->key;
    const std::size_t keys = std::min<std::size_t>(static_cast<std::size_t>(key.getNum()), values.size() / width);
    const double cycle = route.sensor->cycleInterval.getValue().getValue();
    if (keys == 0) return what("it has no keys");
    if (keys > kMaxKeysPerChannel) return what("it has more than a million keys");
    if (!(cycle > 0)) return what("its TimeSensor has no cycle of more than 0 s");
    if (!(cycle <= 1e9)) return what("its TimeSensor has a cycle beyond 1e9 s");
    if (!std::ranges::all_of(values, [](double value) { return std::abs(value) <= 1e15; }))
        return what("a value is not finite, or beyond 1e15");
    const auto keyAt = [&](std::size_t k) { return double{key[static_cast<int>(k)]}; };
    for (std::size_t k = 0; k < keys; ++k) {
        if (!std::isfinite(keyAt(k))) return what("a key is not finite");
        if (k > 0 && keyAt(k) < keyAt(k - 1)) return what("its keys do not ascend");
    }
    if (static_cast<std::size_t>(key.getNum()) != values.size() / width &&
        mismatched_.insert(route.interpolator).second)
        notes_.add("an interpolator has not as many values as keys: what has no partner does not count",
                   nameOf(*route.interpolator));
    const auto rowOf = [&](std::size_t k) { return std::span(values).subspan(k * width, width); };
    // A cycle is from 0 to 1. Keys beyond are only seen through what is between them and others.
    std::size_t first = 0, end = keys;  // those within it
    while (first < keys && keyAt(first) <= 0) ++first;
    while (end > first && keyAt(end - 1) > 1) --end;
    const auto valueAt = [&](double fraction, std::size_t next) {  // the first key behind it
        if (next == 0 || next == keys) {
            const auto row = rowOf(next == 0 ? 0 : keys - 1);
            return std::vector<double>(row.begin(), row.end());
        }
        const double share = (fraction - keyAt(next - 1)) / (keyAt(next) - keyAt(next - 1));
        return between(rowOf(next - 1), rowOf(next), share, turns);
    };
    std::vector<double> times{0}, kept = valueAt(0, first);
    const auto keep = [&](double fraction, std::size_t k) {
        if (!(fraction * cycle > times.back())) return;  // a cycle of next to nothing
        times.push_back(fraction * cycle);
        const auto row = rowOf(k);
        kept.insert(kept.end(), row.begin(), row.end());
    };
    for (std::size_t k = first, next = k; k < end; k = next) {
        const double here = keyAt(k);
        while (next < end && keyAt(next) == here) ++next;
        if (next - k == 1) {
            keep(here, k);
            continue;
        }
        // Several keys of one time are a jump from the first to the last, short beside its neighbours.
        constexpr double kJump = 1e-6;
        const double before = k > first ? keyAt(k - 1) : 0, behind = next < end ? keyAt(next) : 1;
        const bool isLast = here == 1;
        keep(isLast ? 1 - std::min(kJump, 0.25 * (1 - before)) : here, k);
        keep(isLast ? 1 : here + std::min(kJump, 0.5 * (behind - here)), next - 1);
    }
    if (times.back() < cycle) {
        times.push_back(cycle);
        const std::vector<double> last = valueAt(1, end);
        kept.insert(kept.end(), last.begin(), last.end());
    }
    return Keys{std::move(times), std::move(kept)};
}

void CoinMotion::add(SoVRMLTimeSensor* sensor, proto::scene::Channel channel) {
    const auto [animation, isNew] = animations_.try_emplace(sensor);
    if (isNew) order_.push_back(sensor);
    *animation->second.add_channel() = std::move(channel);
}

void CoinMotion::finish(const std::function<std::string(const SoNode&)>& calledName) {
    noteLost();
    std::size_t waiting = 0;
    for (SoVRMLTimeSensor* const sensor : order_) {
        proto::scene::Animation& animation = animations_.at(sensor);
        const bool loops = sensor->loop.getValue();
        animation.set_mode(loops ? proto::scene::Animation::LOOP : proto::scene::Animation::ONCE);
        const bool waits = !runs(*sensor);
        if (!waits && sensor->stopTime.getValue().getValue() > sensor->startTime.getValue().getValue())
            notes_.add("an animation goes on after its stopTime", nameOf(*sensor));
        animation.set_paused(waits);
        if (waits) ++waiting;
        proto::scene::Node* node = scene_.addBeside();
        const std::string name = calledName(*sensor);
        node->set_name(name.empty() ? "animation" : name);
        *node->mutable_animation() = std::move(animation);
    }
    if (waiting > 0)
        scene_.note(fmt::format(
            "{} of its animations wait for an event or a time: they stand until somebody plays them", waiting));
}

}  // namespace tessera
