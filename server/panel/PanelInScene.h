/// What the controls of a panel are in a scene as it stands.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/panel/Panel.h"

namespace tessera {

/// Good until the scene changes. Finding the nodes looks at kLooks nodes at most; siblings are looked at twice.
class PanelInScene {
public:
    static constexpr std::size_t kLooks = 16'384;

    /// `panel` outlives it.
    PanelInScene(const Panel& panel, const Aspect& scene);

    /// Controls that are nothing in this scene, and why: a line each.
    [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }
    /// One of its nodes, or an object whose field it reaches.
    [[nodiscard]] bool holds(ObjectId object) const { return objects_.contains(object); }
    /// Why a list is not what the controls do: it writes another field, or a value that none of them gives. None: it
    /// is.
    [[nodiscard]] std::optional<Error> whyNot(const ChangeList& list) const;

private:
    struct Allowed {
        const PanelControl* control = nullptr;
        std::optional<FieldValue> exactly = {};  ///< none: what the control's kind gives
    };
    void allow(const PanelField& of, const PanelControl& control, const std::string* value, NodeFinder& finder);

    const Panel& panel_;
    const Aspect& scene_;
    std::map<std::pair<ObjectId, FieldId>, std::vector<Allowed>> allowed_;
    std::set<ObjectId> objects_;
    std::vector<std::string> faults_;
};

}  // namespace tessera
