(* Graphs with skip connections as chains of layers. Every value is an affine map of the numbers that leave the last
   layer, each number of it rounded once per operation; an activation makes a layer of its argument, and of what is
   needed behind it. *)

open Refusal

(* Columns in ascending order, without zeros. *)
type row = (int * float) list
(* `first`: the weights that are the first ones since the last layer; "": none yet. *)
type value = { rows : row array; shifts : float array; first : string }
(* The last `kept` outputs of a layer stay as they are. *)
type layer = { weights : string; map : row array; biases : float array; inputs : int; kept : int }
type t = {
  path : string;
  mutable layers : layer list;  (* the last one first *)
  mutable activations : Proved.activation list;
  mutable width : int;  (* of what leaves the last layer, or of the input *)
  mutable numbers : int;
  mutable is_exact : bool;  (* nothing was rounded *)
}

(* As the C++ reader has it: of all layers together, and of products in one operation. *)
let most_numbers = 1 lsl 25
let most_products = 1 lsl 30

let identity n = Array.init n (fun k -> [ k, 1. ])
let start path n =
  { path; layers = []; activations = []; width = n; numbers = 0; is_exact = true },
  { rows = identity n; shifts = Array.make n 0.; first = "" }

(* Exact numbers m 2^e, e a machine integer. *)
let exact x =
  if x = 0. then Z.zero, 0 else let fraction, e = Float.frexp x in Z.of_float (Float.ldexp fraction 53), e - 53
let plus (m, e) (n, f) =
  if Z.sign m = 0 then n, f else if Z.sign n = 0 then m, e
  else if e <= f then Z.add m (Z.shift_left n (f - e)), e else Z.add (Z.shift_left m (e - f)) n, f
let times (m, e) (n, f) = Z.mul m n, e + f
let rounded chain sum =
  let x = Exact.nearest sum in
  if not (Float.is_finite x) then bad_input "%s: weights, or what they fold into, are not finite" chain.path;
  let m, e = exact x in
  if Z.sign (fst (plus sum (Z.neg m, e))) <> 0 then chain.is_exact <- false;
  x

(* The sum of these columns and factors, as a row. *)
let row_of chain terms =
  let sums = Hashtbl.create 16 in
  List.iter (fun (column, factor) ->
      let before = Option.value (Hashtbl.find_opt sums column) ~default:(Z.zero, 0) in
      Hashtbl.replace sums column (plus before factor)) terms;
  let columns = List.sort compare (Hashtbl.fold (fun column _ found -> column :: found) sums []) in
  List.filter_map (fun column ->
      let sum = Hashtbl.find sums column in
      if Z.sign (fst sum) = 0 then None else Some (column, rounded chain sum)) columns

(* W x + b of a value x; the rows of W with a number for each of x. *)
let linear chain weights (w : float array array) (b : float array) (x : value) =
  let sparse row =
    List.filter (fun (_, factor) -> factor <> 0.) (List.mapi (fun k factor -> k, factor) (Array.to_list row)) in
  let w = Array.map sparse w in
  let sizes = Array.map List.length x.rows in
  let products = Array.fold_left (List.fold_left (fun n (k, _) -> n + sizes.(k))) 0 w in
  if products > most_products then bad_input "%s: folding these layers takes too long" chain.path;
  let inner = Array.map (List.map (fun (column, factor) -> column, exact factor)) x.rows in
  let shifts = Array.map exact x.shifts in
  let through row =
    row_of chain (List.concat_map (fun (k, factor) ->
        let outer = exact factor in
        List.map (fun (column, factor) -> column, times outer factor) inner.(k)) row) in
  let shift row bias =
    rounded chain
      (List.fold_left (fun sum (k, factor) -> plus sum (times (exact factor) shifts.(k))) (exact bias) row) in
  { rows = Array.map through w; shifts = Array.map2 shift w b;
    first = if x.first = "" then weights else x.first }

let negated_row = List.map (fun (column, factor) -> column, -. factor)
let negated x = { x with rows = Array.map negated_row x.rows; shifts = Array.map Float.neg x.shifts }
(* Of two values of one size. *)
let sum chain x y =
  let terms = List.map (fun (column, factor) -> column, exact factor) in
  { rows = Array.map2 (fun a b -> row_of chain (terms a @ terms b)) x.rows y.rows;
    shifts = Array.map2 (fun a b -> rounded chain (plus (exact a) (exact b))) x.shifts y.shifts;
    first = if x.first = "" then y.first else x.first }

let append chain weights map biases ~kept =
  chain.numbers <- chain.numbers + Array.length map * chain.width;
  if chain.numbers > most_numbers then
    bad_input "%s: the network as a chain of dense layers has more than 2^25 numbers" chain.path;
  chain.layers <- { weights; map; biases; inputs = chain.width; kept } :: chain.layers;
  chain.width <- Array.length map

let is_never_negative chain row shift =
  let is_behind_relu = match chain.activations with a :: _ -> a = Proved.Relu | [] -> row = [] in
  shift >= 0. && is_behind_relu && List.for_all (fun (_, factor) -> factor > 0.) row

(* A layer of x and what is `needed` behind it, by name; both as maps of what leaves it. Past ReLU those go as
   relu(y), or relu(y) - relu(-y) where y may be negative; past others as they are. Copies of one number are one. *)
let activated chain activation (x : value) (needed : (string * value) list) =
  let is_relu = activation = Proved.Relu in
  let rows = ref [] and shifts = ref [] and count = ref 0 and copies = Hashtbl.create 16 in
  let add row shift = rows := row :: !rows; shifts := shift :: !shifts; incr count; !count - 1 in
  let taken row shift = match row with
    | [ copy ] when shift = 0. ->
      (match Hashtbl.find_opt copies copy with
       | Some k -> k
       | None -> let k = add row shift in Hashtbl.add copies copy k; k)
    | _ -> add row shift in
  let own = Array.map2 (fun row shift -> [ (if is_relu then taken row shift else add row shift), 1. ])
      x.rows x.shifts in
  let own_count = !count in
  let carried row shift =
    if row = [] then [], shift
    else
      let k = taken row shift in
      let others = if not is_relu || is_never_negative chain row shift then []
        else [ taken (negated_row row) (-. shift), -1. ] in
      List.sort compare ((k, 1.) :: others), 0. in
  let behind = List.map (fun (name, (y : value)) ->
      let both = Array.map2 carried y.rows y.shifts in
      name, { rows = Array.map fst both; shifts = Array.map snd both; first = "" }) needed in
  let of_list found = Array.of_list (List.rev !found) in
  let kept = if is_relu then 0 else !count - own_count in
  append chain x.first (of_list rows) (of_list shifts) ~kept;
  chain.activations <- activation :: chain.activations;
  { rows = own; shifts = Array.map (fun _ -> 0.) x.shifts; first = "" }, behind

(* The layers, with what is between them; the last one gives `output`. *)
let finished chain (output : value) =
  append chain output.first output.rows output.shifts ~kept:0;
  let layers = List.rev chain.layers in
  let between = List.map2 (fun layer activation ->
      if layer.kept = 0 then activation else Proved.Keeping (Array.length layer.map - layer.kept, activation))
      (List.filteri (fun k _ -> k < List.length layers - 1) layers) (List.rev chain.activations) in
  layers, between

let dense (layer : layer) () =
  let numbers = Array.make (Array.length layer.map * layer.inputs) 0. in
  Array.iteri (fun i row -> List.iter (fun (j, factor) -> numbers.(i * layer.inputs + j) <- factor) row) layer.map;
  numbers
(* Whether every number of a layer is a float32. *)
let holds_float32 (layer : layer) =
  let is_float x = let y = Exact.float32 x in Float.is_finite y && y = x in
  Array.for_all (List.for_all (fun (_, factor) -> is_float factor)) layer.map && Array.for_all is_float layer.biases
