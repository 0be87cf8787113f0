/// What a DXF file says beside its entities: header, layers, blocks.
#pragma once

#include <map>
#include <string>

#include "server/import/reader/DxfColors.h"
#include "server/import/reader/DxfGroups.h"

namespace tessera {

struct DxfLayer {
    std::string name;
    DxfColor color{7};
    bool hidden = false;  ///< off or frozen, or of points that dimensions measure
};

struct DxfBlock {
    std::string name;
    Vec3d base = Vec3d::Zero();
    bool external = false;    ///< what another drawing holds
    DxfGroups::Mark content;  ///< its first entity; ENDBLK ends it
};

/// Names are found whatever case they are in.
class DxfDocument {
public:
    [[nodiscard]] static Expected<DxfDocument> open(std::string_view bytes);

    /// Reads on until the next section of entities: they follow in `groups`, up to ENDSEC. False: there is none more.
    /// A file has what entities need before them.
    [[nodiscard]] Expected<bool> toEntities();

    /// The layer of that name; one that no table has is white and shown.
    [[nodiscard]] const DxfLayer& layer(std::string_view name);
    [[nodiscard]] const DxfBlock* block(std::string_view name) const;
    /// A value's letters as UTF-8: as the file's version and code page have them, `\U+XXXX` written out.
    [[nodiscard]] std::string text(std::string_view value) const;

    [[nodiscard]] DxfGroups& groups() { return groups_; }
    /// $INSUNITS; 0: none.
    [[nodiscard]] int units() const { return units_; }
    /// Of a code page that is not known here; its letters beyond ASCII are underscores.
    [[nodiscard]] const std::string& strangeCodePage() const { return strange_; }
    /// Once there are no more entities: where the file ends too early; empty: it has its end.
    [[nodiscard]] const std::string& cut() const { return cut_; }

private:
    enum class Letters { kUtf8, kWestern, kCyrillic, kDos437, kDos850, kAscii };
    explicit DxfDocument(DxfGroups groups) : groups_(std::move(groups)) {}
    void readHeader(const DxfRecord& section);
    void readLayer(const DxfRecord& record);

    DxfGroups groups_;
    std::map<std::string, DxfLayer, std::less<>> layers_;  ///< by name in capitals
    std::map<std::string, DxfBlock, std::less<>> blocks_;
    int units_ = 0;
    Letters letters_ = Letters::kWestern;
    std::string strange_, cut_;
};

/// Letters of ASCII as capitals: how names are compared.
[[nodiscard]] std::string dxfKey(std::string_view name);

}  // namespace tessera
