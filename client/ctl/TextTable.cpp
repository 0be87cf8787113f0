#include "client/ctl/TextTable.h"

#include <algorithm>

namespace tessera {

std::string TextTable::text() const {
    if (rows_.size() < 2) return {};
    std::vector<std::size_t> widths(rows_[0].size());
    for (const auto& row : rows_)
        for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
    std::string lines;
    for (const auto& row : rows_) {
        for (std::size_t i = 0; i < row.size(); ++i) {
            lines += row[i];
            if (i + 1 < row.size()) lines.append(widths[i] - row[i].size() + 2, ' ');
        }
        lines += '\n';
    }
    return lines;
}

}  // namespace tessera
