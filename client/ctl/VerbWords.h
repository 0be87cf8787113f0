/// The words of a command, and the verbs that they make. What contradicts itself is refused: kUsage.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/ctl/CommandLine.h"

namespace tessera {

/// The values of all verbs, side by side.
struct VerbWords {
    CommandLine line;
    double timeoutSeconds = 10;
    std::string role;
    bool asSchema = false;
    std::string type;
    verb::Top top;
    verb::Watch watch;
    verb::Trace trace;
    verb::Tree tree;
    verb::Load load;
    verb::Cancel cancel;
    std::vector<double> loadAt;
    double loadScale = 0, loadFit = 0, loadRadius = 0;
    std::string loadUp;
    verb::Set set;
    verb::Get get;
    verb::Remove remove;
    verb::Clone clone;
    verb::Find find;
    verb::Pick pick;
    verb::Drag drag;
    verb::Snapshot snapshot;
    verb::Save save;
    verb::Files files;
    std::string moveNode;
    std::vector<double> moveBy, moveQuaternion;
    bool by = false;
    std::vector<std::string> moveRotate;
    std::optional<double> moveScale;
    std::vector<double> position, lookAt, orientation;
    double scale = 1;
    bool viewBy = false;
    std::vector<std::string> head;
    bool reset = false;
    std::string measureFrom, measureTo;
    std::string navigateWhat, navigateWhere;
    std::uint32_t bookmark = 0;
    bool keep = false;
    verb::Contacts contacts;
    std::string show, picture, budget, exposure, toneMap;
    bool count = false;
    verb::Respond respond;
    std::string decision;
    std::vector<double> respondTo;
    verb::PlayTracker play;
    verb::NewWall newWall;
    verb::Play take;
    double seconds = 0, speed = 1;
    std::string playProtocol = "dtrack";
};
/// Three numbers.
[[nodiscard]] inline Vec3d vector3(const std::vector<double>& v) {
    return {v[0], v[1], v[2]};
}

/// The rotation that turns -Z towards `direction` and keeps +Y as far up as it can.
[[nodiscard]] Expected<Quatd> lookAlong(const Vec3d& direction);

[[nodiscard]] Expected<Verb> moveVerb(const VerbWords& words);
[[nodiscard]] Expected<Verb> viewVerb(const VerbWords& words, bool scaleGiven);
[[nodiscard]] NavigationWish bookmarkWish(std::uint32_t number, bool keep);
[[nodiscard]] Expected<Verb> navigateVerb(const VerbWords& words);
[[nodiscard]] Expected<Verb> contactsVerb(const VerbWords& words, bool framesGiven);
[[nodiscard]] Expected<Verb> showVerb(const VerbWords& words);
[[nodiscard]] Expected<Verb> budgetVerb(const VerbWords& words);
[[nodiscard]] Expected<Verb> exposureVerb(const VerbWords& words);
[[nodiscard]] Expected<Verb> respondVerb(const VerbWords& words);

}  // namespace tessera
