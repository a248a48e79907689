(* MATLAB's .mat files of version 5, as save -v6, save -v7 and scipy.io.savemat write them: a cell array "weights",
   matrices, or one struct of these. *)

open Refusal

type variable = { name : string; contents : contents }
and contents = Array of Named_arrays.t | Cells of Named_arrays.t list | Fields of variable list | Other

let save = "save in MATLAB with save('net.mat', 'weights', '-v7'), or with scipy.io.savemat"
let int8 = 1 and int32 = 5 and uint32 = 6 and matrix = 14 and compressed = 15
let cell_class = 1 and struct_class = 2 and double_class = 6 and single_class = 7 and last_numeric_class = 15

(* (type, bytes) of consecutive data elements, and the rest of them. *)
let next path data at =
  let fail what = bad_input "%s: %s; copy the file again" path what in
  if String.length data - at < 8 then fail "a data element is missing or cut off";
  let word at = Int32.to_int (String.get_int32_le data at) land 0xffffffff in
  let first = word at and second = word (at + 4) in
  if first lsr 16 <> 0 then begin  (* size and type share a word *)
    if first lsr 16 > 4 then fail "a small data element has more than 4 bytes";
    (first land 0xffff, String.sub data (at + 4) (first lsr 16)), at + 8
  end
  else begin
    if second > String.length data - at - 8 then fail "a data element is longer than what holds it";
    let ends = at + 8 + second in
    (first, String.sub data (at + 8) second), if first = compressed then ends else
      min (String.length data) ((ends + 7) / 8 * 8)
  end

let expect path data at kind what =
  let (found, contents), after = next path data !at in
  if found <> kind then bad_input "%s: an array lacks its %s; copy the file again" path what;
  at := after;
  contents

let integers data = List.init (String.length data / 4) (fun k -> Int32.to_int (String.get_int32_le data (4 * k)))

(* Numbers of any type that MATLAB writes for double and single. *)
let numbers_of path name kind data =
  let all width get = Array.init (String.length data / width) (fun k -> get (width * k)) in
  let whole width get = all width (fun at -> float_of_int (get data at)) in
  match kind with
  | 1 -> whole 1 String.get_int8 | 2 -> whole 1 String.get_uint8
  | 3 -> whole 2 String.get_int16_le | 4 -> whole 2 String.get_uint16_le
  | 5 -> whole 4 (fun data at -> Int32.to_int (String.get_int32_le data at))
  | 6 -> whole 4 (fun data at -> Int32.to_int (String.get_int32_le data at) land 0xffffffff)
  | 7 -> all 4 (fun at -> Int32.float_of_bits (String.get_int32_le data at))
  | 9 -> all 8 (fun at -> Int64.float_of_bits (String.get_int64_le data at))
  | _ -> bad_input "%s: \"%s\" holds numbers of a type that is not read; %s" path (shown name) save

let rows_first numbers = function
  | [ rows; columns ] when numbers <> [||] ->
    Array.init (rows * columns) (fun k -> numbers.(k mod columns * rows + k / columns))
  | _ -> numbers

type inside = File | Cell | Struct

let rec variable path data inside =
  if data = "" then { name = ""; contents = Other }
  else begin
    let at = ref 0 in
    let flags = expect path data at uint32 "flags" in
    if String.length flags <> 8 then bad_input "%s: the flags of an array are damaged; copy the file again" path;
    let shape = integers (expect path data at int32 "size") in
    let rank = List.length shape in
    if rank < 2 || rank > 8 || List.exists (fun n -> n < 0) shape || Tensor.count shape > Tensor.most_numbers then
      bad_input "%s: an array has a size that is not read; %s" path save;
    let name = expect path data at int8 "name" in
    let kind = Char.code flags.[0] in
    let contents =
      if kind = cell_class && inside <> Cell then Cells (cells path name data at (Tensor.count shape))
      else if kind = struct_class && inside = File && Tensor.count shape = 1 then Fields (fields path name data at)
      else if kind >= double_class && kind <= last_numeric_class then begin
        if Char.code flags.[1] land 8 <> 0 then bad_input "%s: \"%s\" holds complex numbers; %s" path (shown name) save;
        let (element, listed), _ = next path data !at in
        let numbers = numbers_of path name element listed in
        if Array.length numbers <> Tensor.count shape then
          bad_input "%s: \"%s\" does not fit its shape; copy the file again" path (shown name);
        Array { name; shape; numbers = rows_first numbers shape; is_float32 = kind = single_class }
      end
      else Other in
    { name; contents }
  end

and cells path name data at count =
  if count > 4096 then bad_input "%s: \"%s\" has more than 4096 cells" path (shown name);
  List.init count (fun k ->
      match (variable path (expect path data at matrix "cells") Cell).contents with
      | Array array -> array
      | _ -> bad_input "%s: \"%s\": cell %d is not a numeric array; %s" path (shown name) (k + 1) save)

(* Names have the same length, padded with zeros. *)
and fields path name data at =
  let lengths = integers (expect path data at int32 "length of names") in
  let names = expect path data at int8 "field names" in
  let length = match lengths with [ n ] when n >= 1 && String.length names / n <= 4096 -> n | _ ->
      bad_input "%s: \"%s\": the names of its fields are damaged; copy the file again" path (shown name) in
  List.init (String.length names / length) (fun k ->
      let name = List.hd (String.split_on_char '\000' (String.sub names (k * length) length)) in
      match (variable path (expect path data at matrix "fields") Struct).contents with
      | Array array -> { name; contents = Array { array with name } }
      | contents -> { name; contents })

(* `room`: how many bytes may still be decompressed. *)
let rec variables path data ~room at =
  if at >= String.length data then []
  else
    let (kind, contents), after = next path data at in
    let (kind, contents), room =
      if kind <> compressed then (kind, contents), room
      else match Inflate.inflated ~limit:room contents with
        | inner -> fst (next path inner 0), room - String.length inner
        | exception Inflate.Damaged -> bad_input "%s: its compressed data are damaged; copy the file again" path
        | exception Inflate.Too_long ->
          bad_input "%s: decompresses to more than 128 MiB; save without compression: save(..., '-v6')" path in
    if kind <> matrix then bad_input "%s: a data element is not an array; copy the file again" path;
    let first = variable path contents File in
    first :: variables path data ~room after

let looks_like bytes = String.length bytes >= 128 && Tensor.starts_with "MATLAB " bytes
  && List.mem (String.sub bytes 126 2) [ "IM"; "MI" ]

let are_weights v = v.name = "weights" || v.name = "W"
let are_biases v = List.mem v.name [ "biases"; "bias"; "b" ]

let read path bytes =
  (match String.sub bytes 124 4 with
   | "\000\001IM" -> ()
   | "\000\002IM" ->
     bad_input "%s: is a .mat file of version 7.3 (HDF5), which this checker does not read; %s, and certify that file"
       path save
   | _ -> bad_input "%s: is a .mat file of an unknown version, or not little-endian; %s" path save);
  let found = variables path (String.sub bytes 128 (String.length bytes - 128)) ~room:(1 lsl 27) 0 in
  let holds_layers v = match v.contents with Array _ -> true | Cells _ -> are_weights v | _ -> false in
  let structs = List.filter_map (fun v -> match v.contents with Fields f -> Some f | _ -> None) found in
  let found = match structs with [ only ] when not (List.exists holds_layers found) -> only | _ -> found in
  let cells = List.concat_map (fun v -> match v.contents with
      | Cells cells when are_weights v || are_biases v ->
        let part = if are_weights v then "weight" else "bias" in
        List.mapi (fun k (a : Named_arrays.t) -> { a with name = Printf.sprintf "layer%d.%s" (k + 1) part }) cells
      | _ -> []) found in
  let arrays = List.filter_map (fun v -> match v.contents with Array a -> Some a | _ -> None) found in
  let has_weights = List.exists (fun v -> match v.contents with Cells _ -> are_weights v | _ -> false) found in
  if not has_weights && arrays = [] then
    bad_input "%s: holds neither a cell array \"weights\" nor numeric matrices; %s" path save;
  Named_arrays.tensors path (if has_weights then cells else arrays)
