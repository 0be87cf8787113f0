/// The scene that an import makes, as far as it is made.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/scene/FieldTable.h"
#include "server/import/Importer.h"
#include "server/import/LoadedFile.h"

namespace tessera {

/// The change list, its counts, and what there is to say about it. Objects get their ids in the order in which they are
/// created. Not thread-safe.
class SceneDraft {
public:
    /// `options` outlive it.
    explicit SceneDraft(const ImportOptions& options) : options_(options) {}

    [[nodiscard]] const ImportOptions& options() const { return options_; }
    /// Counts, notes, and what it names; its list is another one until all is there.
    [[nodiscard]] ImportedScene& scene() { return scene_; }
    /// For fields and places of what is created here, and for who creates by himself (`took`).
    [[nodiscard]] ChangeListBuilder& list() { return list_; }

    template <typename T>
    ObjectId create(const T& value) {
        return createObject(Object::of(value));
    }
    ObjectId createObject(const Object& object);
    /// Of the next one that is created.
    [[nodiscard]] ObjectId nextId() const { return ObjectId{nextId_}; }
    /// So many ids were given to what others created.
    void took(std::uint64_t ids) { nextId_ += ids; }
    /// Node of what others created.
    [[nodiscard]] const TypeInfo* typeOfCreated(ObjectId id) const;

    /// A core that is drawn, and its triangles.
    void countDrawable(std::uint64_t triangles);
    /// A node that draws it.
    void countDrawn(std::uint64_t triangles);
    [[nodiscard]] std::size_t drawn() const { return drawn_; }
    /// Whether a camera that the file enables is to be so.
    bool enablesCamera(const LoadedFile& file, bool camerasEnabled, bool wanted);

    /// Before each piece of work. Refused with the reason for which the import is not wanted any more; says how far it
    /// is.
    [[nodiscard]] Expected<void> goOn();
    /// So many nodes come.
    void expect(std::size_t nodes) { expected_ += nodes; }

    [[nodiscard]] Error tooManyNodes() const;
    [[nodiscard]] Error tooDeep() const;

    /// For a person to read, each once.
    void note(std::string text);
    /// Of a number that was out of its bounds: "line:column: what". In a scene it is wrong.
    void noteMended(const LoadedFile& file, const std::string& what);
    /// A file that an Inline or a Movie names: ImportedScene::named.
    void noteNamed(const LoadedFile& file, const std::string& path);
    /// Of a node's name that will not be as the file has it.
    void noteControls(const LoadedFile& file, std::string_view name);

    /// Where somebody wrote what the rules may refuse; the first place counts.
    void isWritten(ObjectId id, std::string where) { writtenAt_.try_emplace(id, std::move(where)); }
    /// Empty: nobody said.
    [[nodiscard]] std::string whereWritten(ObjectId id) const;

private:
    const ImportOptions& options_;
    ChangeListBuilder list_;
    ImportedScene scene_;
    std::uint64_t nextId_ = kFirstPlaceholder;
    std::size_t drawn_ = 0;  ///< nodes that draw something, of model files
    std::size_t steps_ = 0, expected_ = 0;
    std::vector<const TypeInfo*> types_;  ///< of what is created, by the place among the placeholders
    std::map<ObjectId, std::string> writtenAt_;
    std::set<std::string> noted_;
};

}  // namespace tessera
