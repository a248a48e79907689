(* Arrays that are layers by their names, in .mat files and in .npz archives, which are zip archives of .npy arrays. *)

open Refusal

(* Numbers row by row; `is_float32`: stored as float32 or float16. *)
type t = { name : string; shape : int list; numbers : float array; is_float32 : bool }

let words = [ "weights", "weight"; "weight", "weight"; "W", "weight"; "w", "weight"; "biases", "bias"; "bias", "bias";
              "B", "bias"; "b", "bias" ]

(* The text in front of the digits at its end, and these. *)
let stem_and_digits name =
  let rec first k = if k > 0 && Layer_order.is_digit name.[k - 1] then first (k - 1) else k in
  let k = first (String.length name) in
  String.sub name 0 k, String.sub name k (String.length name - k)

(* "fc1.weight" for "fc1_weight", "layer1.bias" for "b1"; None: neither weights nor biases. *)
let tensor_name name =
  let stem, digits = stem_and_digits name in
  let length = String.length stem in
  let stem = if Tensor.ends_with "_" stem then String.sub stem 0 (length - 1) else stem in
  match List.assoc_opt stem words with
  | Some part when digits <> "" -> Some ("layer" ^ digits ^ "." ^ part)
  | _ ->
    List.find_map (fun (word, part) ->
        let front = String.length name - String.length word - 1 in
        if name = word then Some part
        else if front > 0 && List.exists (fun mark -> Tensor.ends_with (mark ^ word) name) [ "."; "_"; "/" ] then
          Some (String.sub name 0 front ^ "." ^ part)
        else None) words

(* 12 for NumPy's "arr_12". *)
let place name = match stem_and_digits name with
  | "arr_", digits when digits <> "" && String.length digits <= 4 -> int_of_string_opt digits
  | _ -> None

let is_vector array = match array.shape with [ _ ] -> true | [ a; b ] -> a = 1 || b = 1 | _ -> false

(* Each matrix begins a layer; biases whose length is the number of its outputs complete it. *)
let names_by_place arrays =
  let name (layer, outputs) array =
    let are_biases = outputs > 0 && is_vector array && Array.length array.numbers = outputs in
    let layer = if are_biases then layer else layer + 1 in
    let outputs = match array.shape with size :: _ when not are_biases -> size | _ -> 0 in
    (layer, outputs), Printf.sprintf "layer%d.%s" layer (if are_biases then "bias" else "weight") in
  snd (List.fold_left_map name (0, 0) arrays)

let tensors path arrays =
  let by_place = arrays <> [] && List.for_all (fun a -> place a.name <> None) arrays in
  let before a b = compare (place a.name) (place b.name) in
  let arrays = if by_place then List.stable_sort before arrays else arrays in
  let named a = match tensor_name a.name with
    | Some name -> name
    | None -> bad_input "%s: \"%s\" is neither the weights nor the biases of a layer; name the arrays W1, b1, W2, b2, \
                         ... or fc1.weight, fc1.bias, ..., matrices as [outputs, inputs]" path (shown a.name) in
  let names = if by_place then names_by_place arrays else List.map named arrays in
  let kind = if List.for_all (fun a -> a.is_float32) arrays then "float32" else "float64" in
  List.map2 (fun name a ->
      let shape = if Tensor.ends_with "bias" name && is_vector a then [ Array.length a.numbers ] else a.shape in
      { Tensor.tensor = name; shape; kind; numbers = (fun () -> a.numbers) }) names arrays

(* .npy: a header, which is a Python literal, and the numbers. *)

let header path entry text =
  let refuse what = bad_input "%s: %s: %s; save with numpy.savez" path (shown entry) what in
  match Scanf.sscanf text " { 'descr' : '%[^']' , 'fortran_order' : %[a-zA-Z] , 'shape' : (%[0-9, ])%[, ]} %!"
          (fun kind order sizes _ -> kind, order, sizes) with
  | exception (Scanf.Scan_failure _ | Failure _ | End_of_file) -> refuse "its header is not as numpy.savez writes it"
  | kind, order, sizes ->
    if order <> "False" then refuse "fortran_order must be False: numpy.ascontiguousarray(array)";
    let kind = match kind with
      | "<f2" -> "float16" | "<f4" -> "float32" | "<f8" -> "float64"
      | _ -> refuse "numbers must be little-endian float16, float32 or float64" in
    let size text = match int_of_string_opt text with Some n -> n | None -> refuse "its shape is damaged" in
    kind, List.map size (List.filter (( <> ) "") (List.map String.trim (String.split_on_char ',' sizes)))

let npy path entry data =
  let refuse what = bad_input "%s: %s: %s; copy the file again" path (shown entry) what in
  if String.length data < 12 || String.sub data 0 6 <> "\x93NUMPY" || data.[6] < '\001' || data.[6] > '\003' then
    refuse "is not a .npy array";
  let begins = if data.[6] = '\001' then 10 else 12 in
  let length = if begins = 10 then String.get_uint16_le data 8 else Int32.to_int (String.get_int32_le data 8) in
  if length < 0 || length > 65536 || length > String.length data - begins then refuse "its header is too long";
  let kind, shape = header path entry (String.sub data begins length) in
  let first = begins + length and count = Tensor.count shape in
  if List.length shape > 8 || count > Tensor.most_numbers then refuse "is too large";
  if count * Tensor.width kind <> String.length data - first then refuse "its shape does not fit its data";
  shape, Array.init count (Tensor.number_at kind data first), kind <> "float64"

let looks_like_npz bytes =
  Pth.is_zip bytes && String.length bytes >= 30 &&
  let length = String.get_uint16_le bytes 26 in
  length >= 4 && Pth.part_is bytes (26 + length) ".npy"

let read_npz path bytes =
  let array (entry, read) =
    if not (Tensor.ends_with ".npy" entry) then bad_input "%s: \"%s\" is not a .npy array; save with numpy.savez" path
        (shown entry);
    let shape, numbers, is_float32 = npy path entry (read ()) in
    { name = String.sub entry 0 (String.length entry - 4); shape; numbers; is_float32 } in
  tensors path (List.map array (Pth.zip_entries path bytes))
