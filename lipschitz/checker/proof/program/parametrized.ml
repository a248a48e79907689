(* Weights that PyTorch computes of other tensors at every call, as after eval(): under spectral_norm W / (u' W v),
   under weight_norm g v / |v| in each row. Every sum is exact and rounded once, as the C++ reader has it. *)

open Refusal
open Enclosed

(* Endings of the names: the stored matrix; u or g; v, None for weight_norm. *)
let styles = [
  "weight_orig", "weight_u", Some "weight_v";
  "parametrizations.weight.original", "parametrizations.weight.0._u", Some "parametrizations.weight.0._v";
  "weight_v", "weight_g", None;
  "parametrizations.weight.original1", "parametrizations.weight.original0", None ]

let refuse path name what =
  bad_input "%s: %s: %s; remove the parametrization before saving: torch.nn.utils.parametrize.remove_parametrizations\
             (layer, \"weight\"), torch.nn.utils.remove_spectral_norm(layer) or \
             torch.nn.utils.remove_weight_norm(layer)" path (shown name) what

(* "fc1." for "fc1.weight_orig" and "weight_orig". *)
let prefix_before name ending =
  if not (Tensor.ends_with ending name) then None
  else
    let prefix = String.sub name 0 (String.length name - String.length ending) in
    if prefix = "" || prefix.[String.length prefix - 1] = '.' then Some prefix else None

let numbers path shape (t : Tensor.t) =
  if t.shape <> shape then refuse path t.tensor "does not have the shape that the parametrization needs";
  if not (Tensor.is_float t.kind) then refuse path t.tensor "does not hold floating-point numbers";
  let found = t.numbers () in
  if not (Array.for_all Float.is_finite found) then refuse path t.tensor "holds a number that is not finite";
  Array.map exactly found

(* The sum of a_i b_i. Between 2^-960 and 2^960 a product of two doubles is the sum of two, which the C++ reader needs
   to be exact. *)
let sum_of_products path name a b =
  let sum = ref empty in
  Array.iteri (fun i a ->
      let size = Float.abs (a.value *. b.(i).value) in
      if a.value <> 0. && b.(i).value <> 0. && not (size >= tiny && size <= 0x1p960) then
        refuse path name "the weight is computed from products below 2^-960 or above 2^960";
      sum := add_product !sum a b.(i)) a;
  value !sum

let usable path name divisor =
  if not (Float.is_finite divisor.value && Float.abs divisor.value > 2. *. divisor.radius) then
    refuse path name "the norm that the weight is divided by is 0";
  divisor

let entries path (matrix : Tensor.t) ~part (_, first, second) prefix =
  let outputs, inputs = match matrix.shape with
    | [ outputs; inputs ] when outputs > 0 && inputs > 0 && Tensor.count matrix.shape <= Tensor.most_numbers ->
      outputs, inputs
    | _ -> refuse path matrix.tensor "only the weights of linear layers may be parametrised" in
  let stored = numbers path matrix.shape matrix in
  let rows = Array.init outputs (fun i -> Array.sub stored (i * inputs) inputs) in
  let needed ending = match part (prefix ^ ending) with
    | Some t -> t | None -> refuse path matrix.tensor ("the file does not hold " ^ prefix ^ ending) in
  let sum = sum_of_products path matrix.tensor and usable = usable path matrix.tensor in
  match second with
  | Some second ->
    let u = numbers path [ outputs ] (needed first) and v = numbers path [ inputs ] (needed second) in
    let divisor = usable (sum u (Array.map (fun row -> sum row v) rows)) in
    Array.map (fun x -> divided x divisor) stored
  | None ->
    let g = numbers path [ outputs; 1 ] (needed first) in
    let scaled i row =
      let square = sum row row in
      if square.value <= 0. then refuse path matrix.tensor "the norm that the weight is divided by is 0";
      let length = usable (square_root square) in
      Array.map (fun x -> divided (sum [| g.(i) |] [| x |]) length) row in
    Array.concat (Array.to_list (Array.mapi scaled rows))

let refuse_leftover path name =
  let is_part = List.exists (fun ending -> prefix_before name ending <> None)
      [ "weight_g"; "weight_orig"; "weight_u" ] in
  if is_part || Tensor.contains "parametrizations." name then
    refuse path name "the weight is parametrised, and the file does not hold all that it is computed from"

(* The tensors with effective weights in place of parametrised ones, and whether all of these are float32 numbers that
   needed no rounding. *)
let effective path tensors =
  let part name = List.find_opt (fun (t : Tensor.t) -> t.tensor = name) tensors in
  let style_of (t : Tensor.t) = List.fold_left (fun found ((matrix, first, _) as style) ->
      match prefix_before t.tensor matrix with
      | Some prefix when part (prefix ^ first) <> None -> Some (style, prefix)
      | _ -> found) None styles in
  let used = List.concat_map (fun t -> match style_of t with
      | Some ((_, first, second), prefix) -> List.map (( ^ ) prefix) (first :: Option.to_list second)
      | None -> []) tensors in
  let are_float32 = ref true in
  let one (t : Tensor.t) = match style_of t with
    | _ when List.mem t.tensor used -> None
    | None -> refuse_leftover path t.tensor; Some t
    | Some (style, prefix) ->
      let found = entries path t ~part style prefix in
      are_float32 := !are_float32 && Array.for_all is_float32 found;
      Some { t with tensor = prefix ^ "weight"; numbers = (fun () -> Array.map (fun x -> x.value) found) } in
  let found = List.filter_map one tensors in
  found, !are_float32
