/// What the controls of a panel are in a scene as it stands.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/panel/Panel.h"

namespace tessera {

/// Good until the scene changes. Finding the nodes looks at kLooks nodes at most; siblings are looked at twice.
class PanelInScene {
public:
    static constexpr std::size_t kLooks = 16'384;

    /// A field that a control leads to.
    struct Target {
        ObjectId node = {}, object = {};       ///< the node, and itself or its core; none: it is not there
        const FieldEntry* field = nullptr;     ///< null: it is not there, or none that such a control moves
        std::optional<FieldValue> value = {};  ///< that it is to have; none: what the control's kind gives
    };
    /// One for each option of a choice and each set of a press; of others one.
    struct Found {
        std::vector<Target> targets;
        std::string fault;  ///< why one of these is none, without names of other nodes; empty: all are
    };

    /// `panel` and `scene` outlive it.
    PanelInScene(const Panel& panel, const Aspect& scene);

    /// Those of the panel, in its order.
    [[nodiscard]] const std::vector<Found>& controls() const { return controls_; }
    /// Controls that are nothing in this scene, or not all that they say, and why: a line each.
    [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }
    /// One of its nodes, or an object whose field it reaches.
    [[nodiscard]] bool holds(ObjectId object) const { return objects_.contains(object); }
    /// The path of one of its nodes, as the panel has it.
    [[nodiscard]] bool holds(const std::string& path) const { return paths_.contains(path); }
    /// Why a list is not what the controls do: it writes another field, or a value that none of them gives. None: it
    /// is.
    [[nodiscard]] std::optional<Error> whyNot(const ChangeList& list) const;

private:
    struct Allowed {
        const PanelControl* control = nullptr;
        std::optional<FieldValue> exactly = {};  ///< none: what the control's kind gives
    };
    /// `value`: a text of one; null: what the control's kind gives.
    [[nodiscard]] Expected<Target> look(const PanelField& of, const PanelControl& control, const std::string* value,
                                        NodeFinder& finder) const;
    void allow(const PanelField& of, const PanelControl& control, const std::string* value, NodeFinder& finder);

    const Panel& panel_;
    const Aspect& scene_;
    std::map<std::pair<ObjectId, FieldId>, std::vector<Allowed>> allowed_;
    std::set<ObjectId> objects_;
    std::set<std::string> paths_;
    std::vector<Found> controls_;
    std::vector<std::string> faults_;
};

}  // namespace tessera
