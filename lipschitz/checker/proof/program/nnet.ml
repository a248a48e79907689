(* The text format .nnet: sizes, normalization, weights and biases. The normalization is folded into the first and the
   last layer. *)

open Refusal
open Enclosed

let format = "the format: numLayers,inputSize,outputSize,maxLayerSize; the sizes; a flag; minimum and maximum inputs; \
              means; ranges; then weights and biases, one neuron per line"
let most_layers = 4096 and most_width = 1 lsl 20

type lines = { path : string; mutable rest : string list; mutable number : int }

let refuse lines what = bad_input "%s: line %d: %s; %s" lines.path lines.number what format

let rec next_line lines = match lines.rest with
  | [] -> refuse lines "the file ends early"
  | line :: rest ->
    lines.rest <- rest;
    lines.number <- lines.number + 1;
    let rec last k = if k > 0 && String.contains "\r ," line.[k - 1] then last (k - 1) else k in
    let line = String.sub line 0 (last (String.length line)) in
    if line = "" || Tensor.starts_with "//" line then next_line lines else line

(* The index after the decimal number that begins at `first`, or `first` if no number begins there. *)
let end_of_decimal line first =
  let size = String.length line in
  let is_at k c = k < size && String.contains c line.[k] in
  let rec digits k = if k < size && Layer_order.is_digit line.[k] then digits (k + 1) else k in
  let begins = if is_at first "-" then first + 1 else first in
  let whole = digits begins in
  let ends = if is_at whole "." then digits (whole + 1) else whole in
  if ends - begins - (if ends > whole then 1 else 0) < 1 then first
  else if not (is_at ends "eE") then ends
  else
    let power = if is_at (ends + 1) "+-" then ends + 2 else ends + 1 in
    let stop = digits power in
    if stop = power then ends else stop

let numbers lines wanted =
  let line = next_line lines in
  let size = String.length line in
  let rec skip k = if k < size && String.contains " ,\t" line.[k] then skip (k + 1) else k in
  let rec go at count found =
    if at >= size || count > wanted then List.rev found else begin
      let first = skip at in
      let first = if first < size && line.[first] = '+' then first + 1 else first in
      let stop = end_of_decimal line first in
      if stop = first then refuse lines "expected a finite number";
      let text = String.sub line first (stop - first) in
      let x = float_of_string text in
      let mantissa = List.hd (String.split_on_char 'e' (String.lowercase_ascii text)) in
      let is_zero = String.for_all (fun c -> not (Layer_order.is_digit c) || c = '0') mantissa in
      if not (Float.is_finite x) || (x = 0. && not is_zero) then refuse lines "expected a finite number";
      if stop < size && not (String.contains ", \t" line.[stop]) then refuse lines "expected a comma";
      go stop (count + 1) (x :: found)
    end in
  let found = go 0 0 [] in
  if List.length found <> wanted then refuse lines (Printf.sprintf "expected %d numbers" wanted);
  Array.of_list found

let count lines most x =
  if not (x >= 1. && x <= float_of_int most && Float.is_integer x) then refuse lines "expected a count";
  int_of_float x

let layer lines inputs outputs =
  let row _ = Onnx_operators.row_of_numbers inputs (let found = numbers lines inputs in fun k -> exactly found.(k)) in
  let rows = Array.init outputs row in
  { Folding.inputs; rows; shifts = Array.init outputs (fun _ -> exactly (numbers lines 1).(0)) }

let normalization means ranges inputs =
  { Folding.inputs; rows = Array.init inputs (fun i -> [ i, divided one (exactly ranges.(i)) ]);
    shifts = Array.init inputs (fun i -> divided (exactly (-. means.(i))) (exactly ranges.(i))) }

let chain_of lines =
  let counts = numbers lines 4 in
  let layers = count lines most_layers counts.(0) in
  let inputs = count lines most_width counts.(1) and outputs = count lines most_width counts.(2) in
  let widths = Array.map (count lines most_width) (numbers lines (layers + 1)) in
  if widths.(0) <> inputs || widths.(layers) <> outputs then refuse lines "the sizes of its layers are inconsistent";
  for _ = 1 to 3 do ignore (next_line lines) done;  (* a flag, minimum and maximum inputs *)
  let means = numbers lines (inputs + 1) in
  let ranges = numbers lines (inputs + 1) in
  if Array.exists (( = ) 0.) ranges then refuse lines "a range is 0";
  let chain = Folding.start inputs in
  let current = ref (normalization means ranges inputs) in
  for k = 0 to layers - 1 do
    current := Folding.composed (layer lines widths.(k) widths.(k + 1)) !current;
    if k + 1 < layers then current := fst (Folding.relu chain (Printf.sprintf "layer%d" (k + 1)) !current [])
  done;
  let scaled = Folding.scaled !current (fun _ -> exactly ranges.(inputs)) in
  let output = Folding.shifted scaled (fun _ -> exactly means.(inputs)) in
  if not (Folding.is_finite output) then raise Not_finite;
  fst (Folding.finished chain (Printf.sprintf "layer%d" layers) output)

let looks_like bytes =
  let is_comment line = line = "\r" || line = "" || Tensor.starts_with "//" line in
  let rec first at = match String.index_from_opt bytes at '\n' with
    | Some stop -> let line = String.sub bytes at (stop - at) in if is_comment line then first (stop + 1) else line
    | None -> String.sub bytes at (String.length bytes - at) in
  let line = String.map (fun c -> if c = '\r' || c = ',' then ' ' else c) (first 0) in
  String.for_all (fun c -> Layer_order.is_digit c || c = ' ') line
  && List.length (List.filter (( <> ) "") (String.split_on_char ' ' line)) = 4

(* As tensors of float64, in the order of evaluation. *)
let read path bytes =
  let lines = { path; rest = String.split_on_char '\n' bytes; number = 0 } in
  match chain_of lines with
  | layers -> List.concat_map (Onnx.tensors "float64") layers
  | exception Folding.Too_large what -> bad_input "%s: %s; certify a smaller network" path what
  | exception Not_finite -> bad_input "%s: its numbers exceed the range of double" path
