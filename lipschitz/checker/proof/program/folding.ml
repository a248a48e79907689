(* Graphs of affine maps and activations as chains of layers. Every value is an affine map of the numbers that leave the
   last layer; an activation makes a layer of its argument, and of what is needed behind it. *)

open Enclosed

(* Columns in ascending order, without numbers that are 0 exactly. *)
type row = (int * Enclosed.t) list
(* M x + c of x with `inputs` numbers. *)
type map = { inputs : int; rows : row array; shifts : Enclosed.t array }
(* The last `kept` outputs of a layer stay as they are. *)
type layer = { name : string; map : map; kept : int }
type t = {
  mutable layers : layer list;  (* the last one first *)
  mutable activations : Proved.activation list;
  mutable width : int;  (* of what leaves the last layer, or of the input *)
  mutable numbers : int;
}

exception Too_large of string

(* As the C++ reader has it: of all layers together, of one map, and of products in one operation. *)
let most_numbers = 1 lsl 25
let most_products = 1 lsl 30

let start width = { layers = []; activations = []; width; numbers = 0 }
let size map = Array.length map.rows
let entries map = Array.fold_left (fun n row -> n + List.length row) 0 map.rows
let identity n =
  { inputs = n; rows = Array.init n (fun k -> [ k, one ]); shifts = Array.make n zero }
let constant inputs shifts = { inputs; rows = Array.map (fun _ -> []) shifts; shifts }
let is_identity map =
  let is_unit k = function [ column, x ] -> column = k && is_one x | _ -> false in
  size map = map.inputs && Array.for_all is_zero map.shifts
  && Array.for_all Fun.id (Array.mapi is_unit map.rows)
let is_finite map =
  Array.for_all (List.for_all (fun (_, x) -> Enclosed.is_finite x)) map.rows
  && Array.for_all Enclosed.is_finite map.shifts

(* The sum of products, each of them in its column, as a row. *)
let row_of terms =
  let sums = Hashtbl.create 16 in
  List.iter (fun (column, outer, inner) ->
      let before = Option.value (Hashtbl.find_opt sums column) ~default:empty in
      Hashtbl.replace sums column (add_product before outer inner)) terms;
  let columns = List.sort compare (Hashtbl.fold (fun column _ found -> column :: found) sums []) in
  List.filter_map (fun column ->
      let x = value (Hashtbl.find sums column) in if is_zero x then None else Some (column, x)) columns

(* x -> second (first x). *)
let composed second first =
  if is_identity first then second else begin
    let sizes = Array.map List.length first.rows in
    let products = Array.fold_left (List.fold_left (fun n (k, _) -> n + sizes.(k))) 0 second.rows in
    if products > most_products then raise (Too_large "folding these layers takes too long");
    let row = function
      | [ k, factor ] when is_one factor -> first.rows.(k)
      | [ k, factor ] -> List.map (fun (column, x) -> column, times factor x) first.rows.(k)
      | row -> row_of (List.concat_map (fun (k, outer) ->
          List.map (fun (column, inner) -> column, outer, inner) first.rows.(k)) row) in
    let shift own row =
      value (List.fold_left (fun sum (k, x) -> add_product sum x first.shifts.(k)) (add empty own) row) in
    let map = { inputs = first.inputs; rows = Array.map row second.rows;
                shifts = Array.map2 shift second.shifts second.rows } in
    if entries map > most_numbers then raise (Too_large "the folded layer has more than 2^25 numbers");
    map
  end

(* a + b, or a - b, of maps of one size. *)
let sum ?(minus = false) a b =
  let signed x = if minus then opposite x else x in
  let both x y = value (add (add empty x) (signed y)) in
  let rec merged a b = match a, b with
    | [], [] -> []
    | (k, x) :: rest, [] -> entry k (both x zero) (merged rest [])
    | [], (k, y) :: rest -> entry k (both zero y) (merged [] rest)
    | (k, x) :: left, (l, y) :: right ->
      if k < l then entry k (both x zero) (merged left b)
      else if l < k then entry l (both zero y) (merged a right)
      else entry k (both x y) (merged left right)
  and entry k x rest = if is_zero x then rest else (k, x) :: rest in
  { a with rows = Array.map2 merged a.rows b.rows; shifts = Array.map2 both a.shifts b.shifts }

(* Each row times its factor. *)
let scaled map factors =
  let row k row = let factor = factors k in
    if is_one factor then row else if is_zero factor then []
    else List.map (fun (column, x) -> column, times factor x) row in
  let shift k x = let factor = factors k in if is_one factor then x else times factor x in
  { map with rows = Array.mapi row map.rows; shifts = Array.mapi shift map.shifts }
let negated map = scaled map (fun _ -> exactly (-1.))
let divided_by map numbers =
  { map with rows = Array.mapi (fun k -> List.map (fun (column, x) -> column, divided x numbers.(k))) map.rows;
             shifts = Array.mapi (fun k x -> divided x numbers.(k)) map.shifts }
let shifted ?(minus = false) map amounts =
  let shift k x = value (add (add empty x) (if minus then opposite (amounts k) else amounts k)) in
  { map with shifts = Array.mapi shift map.shifts }

let stacked = function
  | [] -> invalid_arg "stacked"
  | first :: _ as maps ->
    { first with rows = Array.concat (List.map (fun map -> map.rows) maps);
                 shifts = Array.concat (List.map (fun map -> map.shifts) maps) }
(* The rows `which`, in this order. *)
let selected map which =
  { map with rows = Array.map (fun k -> map.rows.(k)) which; shifts = Array.map (fun k -> map.shifts.(k)) which }

let append chain name map ~kept =
  chain.numbers <- chain.numbers + size map * chain.width;
  if chain.numbers > most_numbers then
    raise (Too_large "the network as a chain of dense layers has more than 2^25 numbers");
  chain.layers <- { name; map = { map with inputs = chain.width }; kept } :: chain.layers;
  chain.width <- size map

(* The rows of a new layer. Copies of one number, of which rows are made by `shared`, are one. *)
type taken = { mutable rows_taken : row list; mutable shifts_taken : Enclosed.t list; mutable count : int;
               copies : (int * Enclosed.t, int) Hashtbl.t }
let none_taken () = { rows_taken = []; shifts_taken = []; count = 0; copies = Hashtbl.create 16 }
let shared taken row shift =
  let add () =
    taken.rows_taken <- row :: taken.rows_taken;
    taken.shifts_taken <- shift :: taken.shifts_taken;
    taken.count <- taken.count + 1;
    taken.count - 1 in
  match row with
  | [ copy ] when is_zero shift ->
    (match Hashtbl.find_opt taken.copies copy with
     | Some k -> k
     | None -> let k = add () in Hashtbl.add taken.copies copy k; k)
  | _ -> add ()
let map_of taken inputs =
  let all found = Array.of_list (List.rev found) in
  { inputs; rows = all taken.rows_taken; shifts = all taken.shifts_taken }

let is_never_negative chain row shift =
  let is_behind_relu = match chain.activations with a :: _ -> a = Proved.Relu | [] -> row = [] in
  is_at_least_0 shift && is_behind_relu && List.for_all (fun (_, x) -> is_at_least_0 x) row

(* The maps `carried` past an activation, where `taken` gives a row for one that is no constant. *)
let carried_past maps taken =
  let by_column (a, _) (b, _) = compare a b in
  let row_of row shift = if row = [] then [], shift else List.stable_sort by_column (taken row shift), zero in
  List.map (fun (map : map) ->
      let both = Array.map2 row_of map.rows map.shifts in
      { map with rows = Array.map fst both; shifts = Array.map snd both }) maps
let behind chain maps = List.map (fun (map : map) -> { map with inputs = chain.width }) maps

(* A layer of relu(x), and what is carried behind it, as maps of what leaves it: y goes as relu(y), or as
   relu(y) - relu(-y) where it may be negative. *)
let relu chain name (x : map) carried =
  let taken = none_taken () in
  let own = Array.map2 (fun row shift -> [ shared taken row shift, one ]) x.rows x.shifts in
  let carried = carried_past carried (fun row shift ->
      let k = shared taken row shift in
      if is_never_negative chain row shift then [ k, one ]
      else
        let opposite_row = List.map (fun (column, y) -> column, opposite y) row in
        [ k, one; shared taken opposite_row (opposite shift), exactly (-1.) ]) in
  append chain name (map_of taken chain.width) ~kept:0;
  chain.activations <- Proved.Relu :: chain.activations;
  { inputs = chain.width; rows = own; shifts = Array.map (fun _ -> zero) own }, behind chain carried

(* The same with another activation, past which what is carried goes as it is. *)
let activated chain activation name (x : map) carried =
  let own = size x and taken = none_taken () in
  let carried = carried_past carried (fun row shift -> [ own + shared taken row shift, one ]) in
  append chain name (stacked [ x; map_of taken x.inputs ]) ~kept:taken.count;
  chain.activations <- activation :: chain.activations;
  { (identity own) with inputs = chain.width }, behind chain carried

(* The layers, with what is between them; the last one gives `output`. *)
let finished chain name output =
  append chain name output ~kept:0;
  let layers = List.rev chain.layers in
  let between = List.map2 (fun layer activation ->
      if layer.kept = 0 then activation else Proved.Keeping (size layer.map - layer.kept, activation))
      (List.filteri (fun k _ -> k < List.length layers - 1) layers) (List.rev chain.activations) in
  layers, between

(* Rows with all their numbers. *)
let rows_of (layer : layer) =
  let dense row =
    let numbers = Array.make layer.map.inputs 0. in
    List.iter (fun (column, x) -> numbers.(column) <- x.value) row;
    numbers in
  Array.map dense layer.map.rows
let biases_of (layer : layer) = Array.map (fun x -> x.value) layer.map.shifts
(* Whether every number of a layer is exactly a float32. *)
let holds_float32 (layer : layer) =
  Array.for_all (List.for_all (fun (_, x) -> is_float32 x)) layer.map.rows && Array.for_all is_float32 layer.map.shifts
