/// Interpolators that time sensors drive, as Animations: each sensor is one.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "server/import/reader/CountedNotes.h"
#include "server/import/reader/PlainScene.h"

class SoField;
class SoNode;
class SoVRMLCoordinateInterpolator;
class SoVRMLInterpolator;
class SoVRMLMaterial;
class SoVRMLTimeSensor;
class SoVRMLTransform;

namespace tessera {

class CoinMotion {
public:
    CoinMotion(PlainScene& scene, CountedNotes& notes) : scene_(scene), notes_(notes) {}

    /// Cuts the routes to the node's fields, so that they are read as the file has them. Whether any of them moves.
    bool hold(SoNode& node);
    /// Whether this field of a node that is held moves.
    [[nodiscard]] bool drives(const SoNode& node, std::string_view field) const;
    /// The message of a node that is held and moves; called for each place where it is used.
    void addTarget(const SoNode& node, proto::scene::Node& message);
    /// What moves the points of a Coordinate that is held; null: nothing, or no interpolator of coordinates.
    [[nodiscard]] const SoVRMLCoordinateInterpolator* pointsOf(const SoNode& coordinate) const;
    /// Keys of one field, which any number of nodes may take.
    struct Track {
        proto::scene::Channel channel;  ///< without a target
        SoVRMLTimeSensor* sensor = nullptr;
    };
    /// Of those points: `weights` has so many as there are `targets` for each key. Nothing: a note says why.
    [[nodiscard]] std::optional<Track> weightsOf(const SoNode& coordinate, std::size_t targets,
                                                 const std::vector<double>& weights);
    void addTarget(const Track& track, proto::scene::Node& message);
    /// Where a colour of a material is seen, if at all.
    enum class Counted { kNot, kAsBase, kAsGlow };
    /// Of a material that is held and moves: once for each material of the scene that stands for it.
    void addMaterial(const SoNode& node, const proto::scene::Material& material, Counted diffuse, Counted emissive);
    /// Of one that is held and moves, and that nothing here can move: a note for each field.
    void leaveOut(const SoNode& node);
    /// Of one that notes name already.
    void passOver(const SoNode& node) { told_.insert(&node); }
    /// A node at the top for each sensor, and notes on all that is held, moves and was never told of.
    /// `calledName`: what people call a node; empty: nobody does.
    void finish(const std::function<std::string(const SoNode&)>& calledName);

private:
    struct Route {
        SoVRMLInterpolator* interpolator = nullptr;
        SoVRMLTimeSensor* sensor = nullptr;
        std::string field;  ///< as the file calls it
    };
    void addChannel(const Route& route, const std::string& field, std::size_t width, const std::vector<double>& values,
                    proto::scene::Channel channel);
    void addBaseColor(const SoNode& node, const proto::scene::Material& material, const Route* color,
                      const Route* opacity);
    /// Within the cycle, in seconds.
    struct Keys {
        std::vector<double> times, values;
        /// Of so many values, on a straight line between two keys.
        [[nodiscard]] std::vector<double> at(double time, std::size_t width) const;
    };
    /// Nothing: a note says why.
    std::optional<Keys> keysOf(const Route& route, bool turns, std::size_t width, const std::vector<double>& values);
    Track trackOf(const Route& route, const std::string& field, const Keys& keys, proto::scene::Channel channel);
    [[nodiscard]] const Route* routeTo(const SoNode& node, std::string_view field) const;
    void standStill(const SoNode& node, std::string_view field);
    void noteLost();
    std::uint32_t keyOf(proto::scene::Node& message);
    void add(SoVRMLTimeSensor* sensor, proto::scene::Channel channel);
    std::vector<double> valuesOf(const Route& route, std::size_t& width) const;

    PlainScene& scene_;
    CountedNotes& notes_;
    std::map<const SoNode*, std::vector<Route>> routes_;
    std::set<const SoNode*> held_;
    std::vector<const SoNode*> moving_;  ///< that have routes, as they came
    std::set<const SoNode*> told_;       ///< whose routes became channels or notes
    std::vector<SoVRMLInterpolator*> interpolators_;
    std::set<const SoVRMLInterpolator*> used_;        ///< that have a route here
    std::set<const SoVRMLInterpolator*> mismatched_;  ///< told: not as many values as keys
    std::vector<SoVRMLTimeSensor*> order_;
    std::map<SoVRMLTimeSensor*, proto::scene::Animation> animations_;
    std::uint32_t lastKey_ = 0;
};

/// Bytes of a name, as LoadedFile has it; longer ones are cut.
inline constexpr std::size_t kLongestName = 1024;
/// A node's name as scenes have them; empty: it has none.
[[nodiscard]] std::string nameOf(const SoNode& node);

}  // namespace tessera
