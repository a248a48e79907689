/// @file CSV files that hold the logs of several vehicles.
///
/// Either a column names the vehicle of each row ("drone_id"), or the columns of each vehicle begin with its name and
/// number ("cf1.x, cf1.y, ..., cf2.x, ..."). The log of one vehicle has the address FILE#VEHICLE.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::logs {

/// A file, and one of the vehicles in it.
struct LogAddress {
  std::string file;
  std::string vehicle;  ///< empty: the whole file
};

/// Splits FILE#VEHICLE. The path of an existing file is that file, whatever its name contains.
LogAddress address_of(const std::string& path);

/// Returns the names of the vehicles in a CSV file, sorted: prefixes of columns, or the entries of a column such as
/// "drone_id", where a number n becomes "cf<n>" if the column is named after Crazyflies, and else "vehicle<n>". Empty
/// for a file of one vehicle, for other formats, and for files that cannot be read. A column names vehicles if it has
/// 2 to 64 different entries, the times of the rows of each entry ascend, and the time span of each overlaps with that
/// of another: a column that counts waypoints or phases does not.
/// @param by_columns false: only by a column that names vehicles, because a columns.toml states which columns are meant
std::vector<std::string> vehicles_in(const std::string& path, bool by_columns = true);

/// Returns the addresses of the logs in a file: one per vehicle, or only the file itself.
std::vector<std::string> addresses_in(const std::string& path, bool by_columns = true);

/// Returns the table of one vehicle as text. Lines keep their numbers: rows of other vehicles become empty lines.
/// @throws files::InputError if the file cannot be read or has no such vehicle.
std::string table_of(const LogAddress& address);

/// @throws files::InputError that lists the addresses if the file holds the logs of several vehicles.
void refuse_several_vehicles(const std::string& path, bool by_columns = true);

}  // namespace swarmcert::logs
