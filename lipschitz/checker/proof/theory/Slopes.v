(** Accepted norms and slopes hold: by a matrix inequality, by a vector, by a product of norms. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Sorting Bent Checker Meaning Steepness Sets Distance
    Blocks Lower Values Fixed Enclosures Intervals Derivatives Centred Claims.
Import ListNotations.
Open Scope R_scope.

Lemma realm_apply m v : reals (apply zero add mul m v) = applyR (realm m) (reals v).
Proof. apply (f_apply zero add mul 0 Rplus Rmult real real_zero real_add real_mul). Qed.
Lemma real_square v : real (squareD v) = square (reals v).
Proof. apply (f_dot zero add mul 0 Rplus Rmult real real_zero real_add real_mul). Qed.

(** Norms *)
Lemma weights_matrix ps p layer : weights_at ps p layer = realm (matrix_at ps p layer).
Proof. reflexivity. Qed.
Lemma norm_above_sound w u rho t f : check [] [] w u rho t f = true ->
  forall d, norm (applyR (realm w) d) <= real u * norm d.
Proof.
  intros H d. set (n := inputs [] w). set (b := repeat 0 (length w)).
  assert (length b = length w) as Hb by apply repeat_length.
  assert (instance ([], w) ([], (realm w, b))) as I by (split; [constructor|split; auto]).
  pose proof (check_sound [] [] w u rho t f H _ I (trim n d) (repeat 0 n) (length_trim n d) (repeat_length 0 n)
    Logic.I) as B.
  unfold run in B. simpl in B. rewrite minus_affine in B by (now rewrite map_length).
  rewrite <- (length_trim n d) in B at 2 4. rewrite minus_zeros in B.
  assert (is_nonnegative u = true /\ shapes n [] w = true) as [Hu Hs].
  { unfold check in H. apply andb_prop in H. destruct H as [S H]. apply andb_prop in S. destruct S as [S _].
    repeat both H. auto. }
  rewrite apply_trim in B.
  - eapply Rle_trans; [exact B|]. apply Rmult_le_compat_l; [now apply real_nonnegative|]. apply norm_le, square_trim.
  - simpl in Hs. rewrite forallb_forall in Hs. apply Forall_forall. intros r Hr. apply in_map_iff in Hr.
    destruct Hr as (r' & <- & Hr). rewrite map_length. apply Nat.eqb_eq. auto.
Qed.
Lemma norm_below_sound w l v : check_norm_below w l v = true ->
  exists d, length d = length (hd [] (realm w)) /\ 0 < norm d /\ real l * norm d <= norm (applyR (realm w) d).
Proof.
  unfold check_norm_below. intros H. repeat both H. apply Nat.eqb_eq in H. exists (reals v). repeat split.
  - rewrite map_length, H. destruct w; simpl; auto. now rewrite map_length.
  - apply sqrt_lt_R0. rewrite <- real_square. now apply real_positive.
  - apply at_most_real in H0. rewrite !real_mul, !real_square, realm_apply in H0. apply real_nonnegative in H2.
    unfold norm. rewrite <- (sqrt_square (real l)) at 1 by auto. rewrite <- sqrt_mult_alt by nra.
        now apply sqrt_le_1_alt.
Qed.

(** Slopes by a matrix inequality *)
(** Part p with each function divided by its b, and the matrix behind it multiplied by that. *)
Definition scaled_layer (b : list R) (l : layer) : layer := (map (timesR b) (fst l), snd l).
Definition divided_by_number : activation -> list R -> list R :=
  by_number (fun b t => / real (unit_of b) * act b t) (fun t => t).
(** Sorting in groups, where they make up the layer; `f` is of the other functions. *)
Definition in_groups (f : activation -> list R -> list R) (a : activation) (y : list R) : list R :=
  match a with
  | Sorted (Groups k) =>
      let n := (length y / k)%nat in if (length y =? n * k)%nat then groupsR n k y else y
  | _ => f a y
  end.
Definition divided : activation -> list R -> list R := in_groups divided_by_number.
Lemma in_groups_keep_length f a : (forall a, keeps_length (f a)) -> keeps_length (in_groups f a).
Proof.
  intros K y. destruct a as [| | | | | | | |[k| |]|]; simpl; auto; try apply K. destruct (Nat.eqb_spec (length y)
    (length y / k * k)) as [E|]; auto. rewrite length_groups; auto.
Qed.
Fixpoint scaled_layers (b : list R) (between : list activation) (later : list layer) (last : layer) : real_stack :=
  match later with
  | [] => ([], scaled_layer b last)
  | l :: later' =>
      let a := hd Relu between in
      let rest := scaled_layers (reals (units a (fst l))) (tl between) later' last in
      ((divided a, scaled_layer b l) :: fst rest, snd rest)
  end.
Definition stack_of (p : part) : real_stack :=
  match hidden p with
  | [] => ([], real_layer (outer p))
  | first :: later =>
      let a := hd Relu (between p) in
      let rest :=
        scaled_layers (reals (units a (fst first))) (tl (between p)) (map real_layer later) (real_layer (outer p)) in
      ((divided a, real_layer first) :: fst rest, snd rest)
  end.
(** Without division. *)
Definition whole_by_number : activation -> list R -> list R := by_number act (fun t => t).
Definition whole : activation -> list R -> list R := in_groups whole_by_number.
Definition functions_and_layers (between : list activation) (hidden : list layer) :
    list ((list R -> list R) * layer) := map (fun l => (whole (fst l), snd l)) (following between hidden).
Lemma whole_activated {A} a (rows : list A) y : chained a rows = true -> length y = length rows ->
  activated a y = whole a y.
Proof.
  assert (forall a y, changes_numbers a = true -> activated a y = whole_by_number a y) as W.
  { clear. intros a y H. revert y. induction a as [| | | | | | | |s|n a IH]; intros y; try discriminate;
    try reflexivity.
    unfold whole_by_number in *. cbn [activated by_number]. now rewrite IH, map_id. }
  intros H L. destruct a as [| | | | | | | |[k| |]|n a]; try discriminate; try reflexivity; cbn [chained] in H.
  - unfold whole. cbn [in_groups activated]. rewrite L, H. apply Nat.eqb_eq in H. apply sort_groups. congruence.
  - now apply W.
Qed.
Lemma units_map {A B} (f : A -> B) a l : units a (map f l) = units a l.
Proof.
  unfold units. revert l. induction a as [| | | | | | | |s|n a IH]; intros l; simpl; rewrite ?map_map; auto.
  now rewrite firstn_map, IH, skipn_map, map_map.
Qed.
Lemma affine_scaled b (l : layer) x :
  affine (fst (scaled_layer b l)) (snd (scaled_layer b l)) x = affine (fst l) (snd l) (timesR b x).
Proof. unfold affine. f_equal. simpl. unfold apply. rewrite map_map. apply map_ext. intros r. apply dot_times. Qed.
Lemma times_app u v x y : length u = length x -> timesR (u ++ v) (x ++ y) = timesR u x ++ timesR v y.
Proof. revert x. induction u as [|a u IH]; intros [|b x]; simpl; try discriminate; auto. intros. rewrite IH; auto. Qed.
Lemma times_divided {A} a (rows : list A) y : length y = length rows ->
  timesR (reals (units a rows)) (divided a y) = whole a y.
Proof.
  assert (timesR (reals (units a rows)) (divided_by_number a y) = whole_by_number a y -> length y = length rows ->
    timesR (reals (units a rows)) (divided a y) = whole a y) as G.
  { intros E L. destruct a as [| | | | | | | |[k| |]|n a]; auto. unfold divided, whole. cbn [in_groups].
    assert (forall u, length u = length rows -> timesR (reals (units (Sorted (Groups k)) rows)) u = u) as U.
    { clear. unfold units. cbn [by_number]. induction rows as [|r rows IH]; intros [|c u]; simpl; try discriminate;
      auto.
      intros H. rewrite IH by lia. unfold unit_of. cbn [is_rising steepest]. rewrite real_one. f_equal. ring. }
    apply U. destruct (Nat.eqb_spec (length y) (length y / k * k)) as [F|]; auto. rewrite length_groups; congruence. }
  intros L. apply G; auto. revert L. clear G.
  assert (forall c (f : R -> R) (rows : list A) y, 0 < real c -> length y = length rows ->
    timesR (reals (map (fun _ => c) rows)) (map (fun t => / real c * f t) y) = map f y) as C.
  { clear. intros c f rows. induction rows as [|r rows IH]; intros [|t y]; simpl; try discriminate; auto.
    intros P L. rewrite IH by auto. f_equal. field. lra. }
  unfold units, divided_by_number, whole_by_number.
  revert rows y. induction a as [| | | | | | | |s|n a IH]; intros rows y L; cbn [by_number];
    try (apply C; auto; apply divided_range_holds).
  rewrite map_app, times_app.
  - rewrite IH by (rewrite !firstn_length; lia). f_equal. rewrite map_id.
    pose proof (C one (fun t => t) (skipn n rows) (skipn n y)) as Q. rewrite real_one in Q.
    rewrite map_id in Q. rewrite <- Q at 2 by (rewrite ?skipn_length; lra || lia). f_equal.
    rewrite <- (map_id (skipn n y)) at 1. apply map_ext. intros. field.
  - rewrite map_length, !length_by_number, !firstn_length. lia.
Qed.
Lemma scaled_run b between later last x : Forall bias_fits later -> run (scaled_layers b between later last) x =
  network (functions_and_layers between later) last (timesR b x).
Proof.
  intros F. revert b between x.
  induction F as [|[m c] later Fc F IH]; intros b between x; [apply (affine_scaled b last)|].
  unfold run in *. cbn [scaled_layers fst snd network functions_and_layers following map].
  rewrite <- (affine_scaled b (m, c)). cbn [fst snd scaled_layer]. rewrite IH, times_divided; auto.
  rewrite length_affine; rewrite map_length; auto.
Qed.
Lemma entrywise_first between : forallb changes_numbers between = true ->
  changes_numbers (hd Relu between) = true /\ forallb changes_numbers (tl between) = true.
Proof. destruct between; simpl; auto. intros H. now apply andb_prop in H. Qed.
Lemma entrywise_chained p : entrywise_between p = true -> chained_between p = true.
Proof.
  unfold entrywise_between, chained_between. generalize (between p) as s.
  induction (hidden p) as [|l ls IH]; intros s H; simpl; auto. destruct (entrywise_first s H) as [E H'].
  rewrite IH by auto. destruct (hd Relu s) as [| | | | | | | |[k| |]|]; simpl in *; auto; try discriminate.
  now rewrite E.
Qed.
Lemma fits_layer p l : fits_part p = true -> In l (layers p) -> length (snd l) = length (fst l).
Proof. unfold fits_part. rewrite forallb_forall. intros H G. now apply Nat.eqb_eq, H. Qed.
Lemma unclamped_network p x : fits_part p = true -> chained_between p = true -> unclamped p x =
  network (functions_and_layers (between p) (map real_layer (hidden p))) (real_layer (outer p)) x.
Proof.
  intros F H. assert (forall l, In l (hidden p) -> length (snd l) = length (fst l)) as B
    by (intros l I; apply (fits_layer p); auto; apply in_or_app; now left).
  revert H. unfold chained_between, unclamped, functions_and_layers. generalize (between p) as s. revert x B.
  induction (hidden p) as [|l ls IH]; intros x B s H; simpl; auto. simpl in H. apply andb_prop in H.
    destruct H as [E H].
  rewrite IH; auto; [|intros; apply B; now right]. f_equal.
  apply (whole_activated _ (fst l)); auto. rewrite length_affine, map_length; auto.
  rewrite !map_length. apply B. now left.
Qed.
Lemma value_run p x : fits_part p = true -> chained_between p = true ->
  value p x = run (stack_of p) (clamped (clamp p) x).
Proof.
  intros F H. unfold value. rewrite unclamped_network by auto. unfold stack_of, functions_and_layers.
  destruct (hidden p) as [|[m c] later] eqn:E; [reflexivity|].
  set (a := hd Relu (between p)). set (y := clamped (clamp p) x).
  assert (forall l, In l (hidden p) -> bias_fits (real_layer l)) as B.
  { intros l I. unfold bias_fits, real_layer. simpl. rewrite !map_length. apply (fits_layer p); auto.
    apply in_or_app. now left. }
  rewrite E in B. assert (Forall bias_fits (map real_layer later)) as Bl
    by (apply Forall_map, Forall_forall; intros l I; apply B; now right).
  pose proof (scaled_run (reals (units a m)) (tl (between p)) (map real_layer later) (real_layer (outer p))
    (divided a (affine (fst (real_layer (m, c))) (snd (real_layer (m, c))) y)) Bl) as R.
  rewrite times_divided in R.
  - symmetry. exact R.
  - rewrite length_affine by (apply B; now left). simpl. apply map_length.
Qed.
Lemma relu_part p : relu_between p = true -> all_relu p.
Proof.
  unfold relu_between, all_relu. rewrite forallb_forall, Forall_forall. intros H a Ha. specialize (H a Ha).
  now destruct a.
Qed.
Lemma relu_network p x : relu_between p = true ->
  unclamped p x = network (relu_layers (hidden p)) (real_layer (outer p)) x.
Proof.
  intros H. apply relu_part in H. unfold all_relu in H. unfold unclamped, relu_layers. revert x H.
  generalize (between p) as s.
  induction (hidden p) as [|l ls IH]; intros s x H; simpl; auto.
  destruct H as [|a s <- H]; simpl; apply IH; auto.
Qed.
(** Functions whose slopes lie in these ranges everywhere. *)
Lemma along_everywhere hidden rs x x' : Forall (fun k => bias_fits (snd k)) hidden ->
  Forall2 (fun (k : (list R -> list R) * layer) r => forall y y', length y = length (weights k) ->
    length y' = length (weights k) -> related (real_relation r) y y' (fst k y) (fst k y')) hidden rs ->
  along hidden (real_relations rs) x x'.
Proof.
  intros B H. revert x x'. induction H as [|[f [m c]] r hidden rs S H IH]; intros x x'; cbn; auto.
  inversion B as [|? ? Bm B']; subst. unfold bias_fits, weights in *. cbn [fst snd] in *. split; auto.
  apply S; now apply length_affine.
Qed.
(** Sorted in groups, or by what is known of each number. *)
Lemma related_in_groups {A} f ranges a (rows : list (list A)) (rowsD : matrixD) y y' :
  length rows = length rowsD -> chained a rowsD = true -> length y = length rows -> length y' = length rows ->
  (changes_numbers a = true -> increments_within (map real_range (ranges a rowsD)) y y' (f a y) (f a y')) ->
  related (real_relation (relation_by ranges a rowsD)) y y' (in_groups f a y) (in_groups f a y').
Proof.
  intros E C L L' H. destruct a as [| | | | | | | |[k| |]|n a]; try discriminate; try (apply H; auto; fail).
  cbn [chained] in C. cbn [relation_by real_relation related in_groups]. rewrite L, L', E, C. apply Nat.eqb_eq in C.
  set (n := (length rowsD / k)%nat) in *. rewrite !length_groups by congruence. repeat split; try congruence.
  apply groups_keep_sums; congruence.
Qed.
(** Number by number: of those that change, and of those that stay. *)
Lemma increments_by_number {A} (f : activation -> R -> R) (g : activation -> A -> rangeD) (k : A -> rangeD)
    (P Q : A -> R -> Prop) a l y y' :
  (forall n u u', P n u -> Q n u' ->
    increment_within (real_range (g (base a) n)) u u' (f (base a) u) (f (base a) u')) ->
  (forall n, real (fst (k n)) <= 1 <= real (snd (k n))) -> Forall2 P l y -> Forall2 Q l y' ->
  increments_within (map real_range (by_number g k a l)) y y'
    (by_number f (fun t => t) a y) (by_number f (fun t => t) a y').
Proof.
  intros H K. assert (forall (F : R -> R) (G : A -> rangeD) l y y',
    (forall n u u', P n u -> Q n u' -> increment_within (real_range (G n)) u u' (F u) (F u')) ->
    Forall2 P l y -> Forall2 Q l y' -> increments_within (map real_range (map G l)) y y' (map F y) (map F y')) as C.
  { clear. intros F G l y y' I HP. revert y'. induction HP as [|n u l y p HP IH]; intros y' HQ;
      inversion HQ as [|? u' ? z q HQ']; subst; simpl; auto. }
  revert l y y' H. induction a as [| | | | | | | |s|n a IH]; intros l y y' H HP HQ; try (now apply C).
  cbn [by_number base] in *. rewrite map_app.
  pose proof (increments_app _ _ _ _ _ _ _ _ _ _
    (IH (firstn n l) (firstn n y) (firstn n y') H (related_firstn _ n _ _ HP) (related_firstn _ n _ _ HQ))
    (C (fun t => t) k (skipn n l) (skipn n y) (skipn n y') (fun m u u' _ _ => stays_within (k m) u u' (K m))
      (related_skipn _ n _ _ HP) (related_skipn _ n _ _ HQ))) as J.
  now rewrite !firstn_skipn in J.
Qed.
Lemma any_numbers {A} (l : list A) (y : list R) : length y = length l -> Forall2 (fun _ _ => True) l y.
Proof. revert y. induction l as [|n l IH]; intros [|u y]; simpl; try discriminate; auto. Qed.
Lemma instance_matrices p : fits_part p = true -> instance (matrices p) (stack_of p).
Proof.
  intros H.
  assert (forall l, In l (layers p) -> of_matrix (fst l) (real_layer l)) as F.
  { intros l Hl. split; [reflexivity|]. simpl. rewrite map_length. now apply (fits_layer p). }
  assert (forall b l, In l (layers p) ->
    of_matrix (scale_columns b (fst l)) (scaled_layer (reals b) (real_layer l))) as Q.
  { intros b l Hl. destruct (F l Hl) as [_ B]. unfold scale_columns. split; simpl in *.
    - rewrite !map_map. apply map_ext. intros r. symmetry. apply (f_times mul Rmult real real_mul).
    - now rewrite B, map_length. }
  assert (forall a, keeps_length (divided a)) as K
    by (intros a; apply in_groups_keep_length; intros b y; apply length_by_number).
  unfold matrices, stack_of, layers in *. destruct (hidden p) as [|first later]; simpl.
  - split; [constructor|]. apply F. now left.
  - assert (of_matrix (fst first) (real_layer first)) as F1 by (apply F; now left).
    assert (forall b l, In l (later ++ [outer p]) ->
      of_matrix (scale_columns b (fst l)) (scaled_layer (reals b) (real_layer l))) as Q'
      by (intros; apply Q; now right).
    clear F Q. generalize (units (hd Relu (between p)) (fst first)) as b, (tl (between p)) as s.
    assert (forall b s, instance (scaled_matrices b s later (outer p))
      (scaled_layers (reals b) s (map real_layer later) (real_layer (outer p)))) as I.
    { induction later as [|l later IH]; intros b s; simpl.
      - split; [constructor|]. apply Q'. now left.
      - rewrite units_map.
        destruct (IH ltac:(intros; apply Q'; now right) (units (hd Relu s) (fst l)) (tl s)) as [I1 I2].
        split; [|exact I2]. constructor; [|exact I1]. split; [|apply K]. apply Q'. now left. }
    intros b s. destruct (I b s) as [I1 I2]. split; [|exact I2]. constructor; [|exact I1]. split; [exact F1|apply K].
Qed.
Lemma divided_increments {A} a (rows : list A) y y' : length y = length rows -> length y' = length rows ->
  increments_within (map real_range (divided_ranges a rows)) y y' (divided_by_number a y) (divided_by_number a y').
Proof.
  intros L L'. unfold divided_ranges. rewrite <- (by_number_alike (fun _ => divided_range (base a)) a).
  apply (increments_by_number _ _ _ (fun _ _ => True) (fun _ _ => True)); auto using any_numbers.
  - intros _ u u' _ _. apply (slope_increment (fun t => / real (unit_of (base a)) * act (base a) t)).
    apply divided_range_holds.
  - intros _. apply divided_range_has_one.
Qed.
Lemma divided_along p x x' : fits_part p = true -> chained_between p = true ->
  along (fst (stack_of p)) (real_relations (relations_by divided_ranges p)) x x'.
Proof.
  intros H C. destruct (instance_matrices p H) as [I _].
  apply along_everywhere; [now apply (stages_fit (fst (matrices p)))|].
  revert C. clear. unfold relations_by, stack_of, chained_between.
    destruct (hidden p) as [|first later]; [constructor|].
  cbn. intros C. apply andb_prop in C. destruct C as [C1 C].
  assert (forall a (l : layerD) y y', chained a (fst l) = true -> length y = length (fst l) -> length y' = length
    (fst l)
    -> related (real_relation (relation_by divided_ranges a (fst l))) y y' (divided a y) (divided a y')) as G.
  { clear. intros a l y y' C L L'. apply (related_in_groups _ _ a (fst l)); auto.
    intros _. now apply divided_increments. }
  constructor.
  - cbn [fst snd weights real_layer]. intros y y' L L'. rewrite map_length in L, L'. now apply G.
  - revert C. generalize (reals (units (hd Relu (between p)) (fst first))) as b, (tl (between p)) as s.
    clear C1. induction later as [|l later IH]; intros b s C; cbn in C |- *; constructor.
    + cbn [fst snd weights scaled_layer real_layer]. intros y y' L L'. rewrite !map_length in L, L'.
      apply andb_prop in C.
      now apply G.
    + apply andb_prop in C. now apply IH.
Qed.
Lemma length_value p x : fits_part p = true -> length (value p x) = length (fst (outer p)).
Proof.
  intros H. assert (length (snd (outer p)) = length (fst (outer p))) as L
    by (apply (fits_layer p); auto; apply in_or_app; right; now left).
  unfold value, unclamped. generalize (between p) as s, (clamped (clamp p) x) as y.
  induction (map real_layer (hidden p)) as [|l ls IH]; intros s y; simpl; auto.
  rewrite length_affine by (simpl; now rewrite !map_length). simpl. now rewrite map_length.
Qed.
Lemma distance_nonneg scale x y : 0 <= distance scale x y. Proof. apply sqrt_pos. Qed.

(** For a bound of n by movements in units of their scale. *)
Lemma moved_bound moves scale c u n x y :
  positive_scale scale = true -> 0 <= u -> agree moves x y ->
  (forall v w base, length v = count moves -> length w = count moves -> length base = length moves ->
    plusR (applyR (realm (selector moves scale)) v) base = clamped c x ->
    plusR (applyR (realm (selector moves scale)) w) base = clamped c y -> n <= u * norm (minus v w)) ->
  n <= u * distance scale x y.
Proof.
  intros Hs Hu Ha Hn. pose proof (agree_clamped c _ _ _ Ha) as Hc. destruct (agree_lengths _ _ _ Hc) as [Hx Hy].
  eapply Rle_trans.
  - apply (Hn (movement moves scale (clamped c x)) (movement moves scale (clamped c y)) (staying moves (clamped c x)));
      auto using length_movement, length_staying; [|rewrite (agree_staying _ _ _ Hc)]; now apply selected.
  - apply Rmult_le_compat_l; auto. unfold norm. rewrite square_movement by auto. apply sqrt_le_1_alt, square_in_clamped.
    destruct (agree_lengths _ _ _ Ha). congruence.
Qed.

(** The parts of f, each after a vector has been added to what came before. *)
Definition stacks_of ps (f : function) (rest : list R) (of_part : part -> real_stack) : list (list R * real_stack) :=
  match f with
  | Alone p => [([], of_part (part_at ps p))]
  | Set_of phi rho => [([], of_part (part_at ps phi)); (rest, of_part (part_at ps rho))]
  end.
Lemma chain_sound ps f moves scale u rho t factor (matrices_of : part -> stack) (of_part : part -> real_stack) ranges
    rest x y :
  well_formed ps f moves scale = true -> forallb chained_between (parts_of ps f) = true -> is_nonnegative u = true ->
  check_parts (concat ranges) ([], selector moves scale) (map matrices_of (parts_of ps f)) u rho t factor = true ->
  (forall p, fits_part p = true -> instance (matrices_of p) (of_part p)) ->
  (forall p z, fits_part p = true -> chained_between p = true ->
    value p z = run (of_part p) (clamped (clamp p) z)) ->
  agree moves x y -> let c := clamped (clamp (part_at ps (moved f))) in
  along_after (stacks_of ps f rest of_part) ranges (c x) (c y) ->
  norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y.
Proof.
  unfold well_formed. intros H He Hu HP HI HV Ha A. do 4 both H.
  rename H0 into Hl, H1 into Hs, H2 into Hm, H3 into Hc.
  apply real_nonnegative in Hu. set (S := selector moves scale) in *.
  assert (forall base, length base = length moves -> instance ([], S) ([], (realm S, base))) as I.
  { intros base Hb. split; [constructor|]. split; auto. simpl. unfold S. now rewrite length_selector. }
  assert (inputs [] S = count moves) as Hi by apply selector_columns.
  pose proof (check_parts_sound [] ranges _ _ _ _ _ _ HP) as C. clear HP. cbn [fst snd] in C.
  destruct f as [p|phi k]; cbn [parts_of map forallb tl moved value_of stacks_of] in *.
  - both H. both He. rewrite !HV by auto.
    apply (moved_bound moves scale (clamp (part_at ps p))); auto. intros v w base Hv Hw Hb Ex Ey.
    pose proof (C _ [([], of_part (part_at ps p))] (I base Hb)
      (Forall2_cons (matrices_of (part_at ps p)) ([], of_part (part_at ps p)) (HI _ H) (Forall2_nil _)) v w) as B.
    assert (forall z, run ([], (realm S, base)) z = plusR (applyR (realm S) z) base) as E1 by reflexivity.
    fold S in Ex, Ey. rewrite !E1, Ex, Ey in B. cbn [run_after] in B. rewrite !plus_nil_r in B.
    apply B; auto; first [congruence|exact Logic.I].
  - both H. both H0. apply andb_prop in He. destruct He as [He He']. both He'.
    both Hc. rewrite !HV by auto. destruct (clamp (part_at ps k)) eqn:E; [|discriminate]. simpl clamped.
    apply (moved_bound moves scale (clamp (part_at ps phi))); auto. intros v w base Hv Hw Hb Ex Ey.
    pose proof (C _ [([], of_part (part_at ps phi)); (rest, of_part (part_at ps k))] (I base Hb)
      (Forall2_cons (matrices_of (part_at ps phi)) ([], of_part (part_at ps phi)) (HI _ H)
        (Forall2_cons (matrices_of (part_at ps k)) (rest, of_part (part_at ps k)) (HI _ H0) (Forall2_nil _))) v w) as B.
    assert (forall z, run ([], (realm S, base)) z = plusR (applyR (realm S) z) base) as E1 by reflexivity.
    fold S in Ex, Ey. rewrite !E1, Ex, Ey in B. cbn [run_after] in B. rewrite !plus_nil_r in B.
    apply B; auto; first [congruence|exact Logic.I].
Qed.
(** Pairs side by side *)
Lemma map_interleaved {A B} (g : A -> B) u v : map g (interleaved u v) = interleaved (map g u) (map g v).
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. now rewrite IH. Qed.
Lemma map_by_pairs {A B} (g : A -> B) l : map g (by_pairs l) = by_pairs (map g l).
Proof. unfold by_pairs. now rewrite map_interleaved, map_length, firstn_map, skipn_map. Qed.
Lemma map_turned {A B} (g : A -> B) l : map g (turned l) = turned (map g l).
Proof. unfold turned. now rewrite map_interleaved, map_length, firstn_map, skipn_map. Qed.
Lemma realm_turned_if b m : realm (turned_if b m) = turned_if b (realm m).
Proof. destruct b; simpl; auto. rewrite !map_map. apply map_ext. intros. apply map_turned. Qed.
Lemma length_interleaved {A} (u v : list A) : length u = length v -> length (interleaved u v) = (length u * 2)%nat.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto. Qed.
Lemma dot_interleaved u v p q : length u = length v -> length p = length u -> length q = length u ->
  dotR (interleaved u v) (interleaved p q) = dotR u p + dotR v q.
Proof.
  revert v p q. induction u as [|a u IH]; intros [|b v] [|c p] [|d q]; simpl; try discriminate; intros; [ring|].
  rewrite IH by lia. ring.
Qed.
Lemma plus_interleaved u v p q : length u = length v -> length p = length u -> length q = length u ->
  plusR (interleaved u v) (interleaved p q) = interleaved (plusR u p) (plusR v q).
Proof.
  revert v p q. induction u as [|a u IH]; intros [|b v] [|c p] [|d q]; simpl; try discriminate; intros; auto.
  now rewrite IH by lia.
Qed.
Lemma half_lengths {A} (l : list A) : Nat.even (length l) = true ->
  length (firstn (Nat.div2 (length l)) l) = Nat.div2 (length l) /\
  length (skipn (Nat.div2 (length l)) l) = Nat.div2 (length l).
Proof.
  intros H. apply Nat.even_spec in H. destruct H as [h H]. rewrite H, Nat.div2_double, firstn_length, skipn_length.
  lia.
Qed.
Lemma dot_turned r u v : length u = length v -> length r = (length u + length v)%nat ->
  dotR (turned r) (interleaved v u) = dotR r (u ++ v).
Proof.
  intros E L. assert (length r = 2 * length u)%nat as L2 by lia. unfold turned. rewrite L2, Nat.div2_double.
  assert (length (firstn (length u) r) = length u) as F by (rewrite firstn_length; lia).
  assert (length (skipn (length u) r) = length u) as S by (rewrite skipn_length; lia).
  rewrite dot_interleaved by congruence. rewrite <- (firstn_skipn (length u) r) at 3.
  rewrite dot_app by auto. ring.
Qed.
Lemma apply_turned m u v : length u = length v -> Forall (fun r => length r = (length u + length v)%nat) m ->
  applyR (map turned m) (interleaved v u) = applyR m (u ++ v).
Proof.
  intros E H. unfold apply. rewrite map_map. induction H as [|r m L H IH]; simpl; auto.
  now rewrite IH, dot_turned.
Qed.
Lemma affine_by_pairs m b x : length b = length m -> Nat.even (length m) = true ->
  affine (by_pairs m) (by_pairs b) x = by_pairs (affine m b x).
Proof.
  intros E H. unfold affine. assert (applyR (by_pairs m) x = by_pairs (applyR m x)) as -> by apply map_by_pairs.
  assert (length (applyR m x) = length m) as L by apply map_length.
  assert (length (plusR (applyR m x) b) = length m) as Lp by (apply (length_affine m b x E)).
  unfold by_pairs. rewrite L, E, Lp. set (h := Nat.div2 (length m)).
  assert (forall (l : list R), length l = length m -> length (firstn h l) = h /\ length (skipn h l) = h) as F.
  { intros l Hl. unfold h. rewrite <- Hl. apply half_lengths. now rewrite Hl. }
  destruct (F _ L), (F b E). rewrite plus_interleaved by congruence.
  assert (forall k u v, length u = length v -> plusR (firstn k u) (firstn k v) = firstn k (plusR u v)
    /\ plusR (skipn k u) (skipn k v) = skipn k (plusR u v)) as P.
  { clear. induction k as [|k IH]; intros [|a u] [|c v]; simpl; try discriminate; auto. intros N.
    destruct (IH u v ltac:(lia)) as [-> ->]. auto. }
  destruct (P h (applyR m x) b ltac:(congruence)) as [-> ->]. reflexivity.
Qed.
Lemma sorted_pairs u v : length u = length v ->
  sort_layer (Groups 2) (interleaved u v) = interleaved (both Rmin u v) (both Rmax u v).
Proof.
  intros E. rewrite (sort_groups (length u)) by now rewrite length_interleaved.
  revert v E. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto. intros E.
  unfold both in *. simpl. rewrite IH by lia. reflexivity.
Qed.
Lemma even_interleaved (y : list R) : Nat.even (length y) = true -> exists u v, length u = length v /\
  y = interleaved u v.
Proof.
  assert (forall n (y : list R), (length y <= n)%nat -> Nat.even (length y) = true -> exists u v, length u = length v /\
    y = interleaved u v) as G.
  { clear. induction n as [|n IH]; intros [|a [|b y]]; simpl; intros L H; try discriminate; try lia;
      try (exists [], []; now split).
    destruct (IH y ltac:(lia) H) as (u & v & E & ->). exists (a :: u), (b :: v). simpl. split; auto. }
  intros H. apply (G (length y)); auto.
Qed.
Lemma pairs_of_interleaved f (u v : list R) : length u = length v -> of_pairs f (interleaved u v) = both f u v.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; try discriminate; auto. intros. unfold both in *.
  simpl.
  now rewrite IH by lia. Qed.
(** What leaves sorted pairs, and the same numbers in their other places. *)
Definition turned_into (turn : bool) (x x' : list R) : Prop :=
  if turn then exists u v, length u = length v /\ x = u ++ v /\ x' = interleaved v u else x = x'.
Lemma affine_turned turn (l : layerD) x x' : turned_into turn x x' ->
  (turn = true -> Forall (fun r => length r = length x) (fst l)) ->
  affine (turned_if turn (realm (fst l))) (reals (snd l)) x' = affine (realm (fst l)) (reals (snd l)) x.
Proof.
  destruct turn; simpl; [|now intros -> _]. intros (u & v & E & -> & ->) H. unfold affine. f_equal.
  apply apply_turned; auto. apply Forall_map. eapply Forall_impl; [|apply H; auto]. cbn. intros r L.
  now rewrite map_length, L, app_length.
Qed.
Lemma regrouped_value turn between hidden last x x' :
  Forall (fun l : layerD => length (snd l) = length (fst l)) hidden -> turns_fit between hidden last = true ->
  turned_into turn x x' -> (turn = true -> Forall (fun r => length r = length x) (fst (hd last hidden))) ->
  let r := regrouped_layers turn between hidden last in
  layer_by_layer (fst r) (map real_layer (fst (snd r))) (real_layer (snd (snd r))) x' =
  layer_by_layer between (map real_layer hidden) (real_layer last) x.
Proof.
  revert turn between x x'. induction hidden as [|[m b] hidden IH]; intros turn between x x' B T X S; cbv zeta.
  - cbn. rewrite realm_turned_if. now apply affine_turned.
  - inversion B as [|? ? Bm B']; subst. cbn [fst snd] in Bm. cbn [hd] in S.
    set (y := affine (realm m) (reals b) x).
    assert (affine (realm (turned_if turn m)) (reals b) x' = y) as Y
      by (rewrite realm_turned_if; now apply (affine_turned turn (m, b))).
    assert (length y = length m) as Ly by (unfold y; rewrite length_affine; rewrite !map_length; auto).
    cbn [turns_fit] in T. apply andb_prop in T. destruct T as [T T'].
    assert (Nat.even (length m) = true ->
      affine (realm (by_pairs (turned_if turn m))) (reals (by_pairs b)) x' = by_pairs y) as P.
    { intros V. rewrite <- Y, !map_by_pairs.
      assert (length (turned_if turn m) = length m) as Lm by (destruct turn; simpl; auto using map_length).
      apply affine_by_pairs; rewrite !map_length; congruence. }
    assert (forall a, regrouped_layers turn between ((m, b) :: hidden) last =
      (let rest := regrouped_layers false (tl between) hidden last in
       (a :: fst rest, ((turned_if turn m, b) :: fst (snd rest), snd (snd rest)))) -> hd Relu between = a ->
      let r := regrouped_layers turn between ((m, b) :: hidden) last in
      layer_by_layer (fst r) (map real_layer (fst (snd r))) (real_layer (snd (snd r))) x' =
      layer_by_layer between (map real_layer ((m, b) :: hidden)) (real_layer last) x) as Same.
    { intros a -> E. cbv zeta. cbn [fst snd map layer_by_layer hd tl real_layer]. rewrite Y, E. fold y.
      apply IH; auto; [reflexivity|discriminate]. }
    assert (forall s rows bias, (Sorted s = hd Relu between) -> affine (realm rows) (reals bias) x' =
        match s with Halves => by_pairs y | _ => y end -> s = Halves \/ s = Pairs ->
      Nat.even (length m) = true -> Forall (fun r => length r = length m) (fst (hd last hidden)) ->
      let rest := regrouped_layers true (tl between) hidden last in
      layer_by_layer (Sorted (Groups 2) :: fst rest) (map real_layer ((rows, bias) :: fst (snd rest)))
        (real_layer (snd (snd rest))) x' =
      layer_by_layer between (map real_layer ((m, b) :: hidden)) (real_layer last) x) as Paired.
    { intros s rows bias E R HP V F. cbv zeta. cbn [fst snd map layer_by_layer hd tl real_layer]. rewrite R, <- E.
      fold y.
      cbn [activated].
      assert (exists u v, length u = length v /\ (length u + length v = length y)%nat
        /\ sort_layer s y = both Rmax u v ++ both Rmin u v
        /\ match s with Halves => by_pairs y | _ => y end = interleaved u v) as (u & v & L & N & Q & ->).
      { rewrite <- Ly in V. destruct HP as [->| ->].
        - destruct (half_lengths y V) as [H1 H2].
          exists (firstn (Nat.div2 (length y)) y), (skipn (Nat.div2 (length y)) y). split; [congruence|].
          split; [now rewrite <- app_length, firstn_skipn|now split].
        - destruct (even_interleaved y V) as (u & v & L & ->). exists u, v. split; auto.
          split; [rewrite length_interleaved; lia|]. split; auto.
          unfold sort_layer. cbn [sorted_by]. now rewrite !pairs_of_interleaved. }
      rewrite Q, sorted_pairs by auto.
      assert (length (both Rmax u v) = length u) as L1 by (rewrite length_both; lia).
      assert (length (both Rmin u v) = length u) as L2 by (rewrite length_both; lia).
      apply IH; auto.
      - exists (both Rmax u v), (both Rmin u v). split; [congruence|]. now split.
      - intros _. eapply Forall_impl; [|exact F]. cbn. intros r ->. rewrite app_length, L1, L2, <- Ly.
        lia. }
    destruct (hd Relu between) as [| | | | | | | |[k| |]|n a] eqn:E;
      try (eapply Same; [cbn [regrouped_layers]; rewrite E; reflexivity|reflexivity]).
    + apply andb_prop in T. destruct T as [V F]. rewrite forallb_forall in F. cbn [regrouped_layers]. rewrite E.
      apply (Paired Halves); auto. apply Forall_forall. intros r Hr. apply Nat.eqb_eq. auto.
    + apply andb_prop in T. destruct T as [V F]. rewrite forallb_forall in F. cbn [regrouped_layers]. rewrite E.
      apply (Paired Pairs); auto. apply Forall_forall. intros r Hr. apply Nat.eqb_eq. auto.
Qed.
Lemma value_regrouped p x : may_regroup p = true -> value (regrouped p) x = value p x.
Proof.
  unfold may_regroup. intros H. apply andb_prop in H. destruct H as [F T]. unfold value, unclamped, regrouped.
  cbn [between hidden outer clamp]. apply regrouped_value; auto; [|reflexivity|discriminate].
  apply Forall_forall. intros l I. apply (fits_layer p); auto. apply in_or_app. now left.
Qed.
Lemma part_regrouped ps k : part_at (map regrouped ps) k = regrouped (part_at ps k).
Proof. unfold part_at. now rewrite <- (map_nth regrouped). Qed.
Lemma slope_sound ps f moves scale u rho t factor :
  check_slope ps f moves scale u rho t factor = true -> holds ps (Slope_at_most f moves scale u).
Proof.
  unfold check_slope. intros H rest x y Ha _. apply andb_prop in H. destruct H as [G H].
  set (qs := map regrouped ps) in *. do 3 both H. rewrite flat_map_concat_map in H0.
  assert (forall z, value_of qs f rest z = value_of ps f rest z) as V.
  { intros z. unfold qs. destruct f as [p|phi k]; cbn [parts_of forallb value_of] in *; rewrite !part_regrouped.
    - apply andb_prop in G. now apply value_regrouped.
    - apply andb_prop in G. destruct G as [G1 G2]. apply andb_prop in G2. now rewrite !value_regrouped. }
  rewrite <- !V.
  apply (chain_sound qs f moves scale u rho t factor matrices stack_of _ rest x y H H2 H1 H0 instance_matrices
    value_run Ha).
  unfold well_formed in H. do 4 both H. destruct f as [p|phi k]; cbn in *.
  - apply andb_prop in H, H2. split; auto. now apply divided_along.
  - apply andb_prop in H, H2. destruct H as [F1 F2], H2 as [C1 C2]. apply andb_prop in F2, C2.
    split; [now apply divided_along|]. split; auto. now apply divided_along.
Qed.

(** Slopes by products of norms *)
Definition norm_bound_of (l : layerD) (u : R) := 0 <= u /\ forall d, norm (applyR (fst (real_layer l)) d) <= u * norm d.
Definition product_R (us : list R) := fold_right Rmult 1 us.
Lemma find_norm_sound ps accepted p layer u : Forall (holds ps) accepted -> find_norm accepted p layer = Some u ->
  forall d, norm (applyR (weights_at ps p layer) d) <= real u * norm d.
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|]. destruct c; simpl; auto.
  destruct (Nat.eqb_spec p p0), (Nat.eqb_spec layer layer0); simpl; auto. intros E d. inversion E. subst. apply Hc.
Qed.
Lemma norms_sound ps accepted p v : Forall (holds ps) accepted ->
  forall ls before, layers (part_at ps p) = before ++ ls -> norms accepted p (length before) ls = Some v ->
  exists us, Forall2 norm_bound_of ls us /\ real v = product_R us.
Proof.
  intros HA ls. revert v. induction ls as [|l ls IH]; intros v before E; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. apply real_one.
  - destruct (find_norm accepted p (length before)) as [u|] eqn:Hu; [|discriminate].
    destruct (norms accepted p (S (length before)) ls) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative u) eqn:Hn; [|discriminate]. intros H. inversion H. subst.
    destruct (IH w (before ++ [l])) as (us & B & G).
    + now rewrite <- app_assoc.
    + now rewrite app_length, Nat.add_comm.
    + exists (real u :: us). rewrite real_mul. simpl. rewrite G. split; auto. constructor; auto. split.
      * now apply real_nonnegative.
      * intros d. pose proof (find_norm_sound _ _ _ _ _ HA Hu d) as F. unfold weights_at in F.
        rewrite E, nth_middle in F. exact F.
Qed.
Lemma product_nonneg ls us : Forall2 norm_bound_of ls us -> 0 <= product_R us.
Proof. intros H. induction H as [|l u ls us [Hu _] H IH]; simpl; [lra|]. now apply Rmult_le_pos. Qed.
Lemma affine_bound l u x y : norm_bound_of l u -> length (snd l) = length (fst l) ->
  norm (minus (affine (fst (real_layer l)) (snd (real_layer l)) x) (affine (fst (real_layer l)) (snd (real_layer l)) y))
      <= u * norm (minus x y).
Proof. intros [_ H] L. rewrite minus_affine by (simpl; now rewrite !map_length). apply H. Qed.
Definition with_slopes_R {A} (between : list activation) (hidden : list A) (u : R) : R :=
  fold_right (fun l v => real (steepest (fst l)) * v) u (following between hidden).
Lemma with_slopes_nonneg {A} between (hidden : list A) u : 0 <= u -> 0 <= with_slopes_R between hidden u.
Proof.
  intros Hu. revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  apply Rmult_le_pos; [apply all_slopes|apply IH].
Qed.
Lemma real_with_slopes {A} between (hidden : list A) u :
  real (with_slopes between hidden u) = with_slopes_R between hidden (real u).
Proof.
  revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  unfold with_slopes, with_slopes_R in *. simpl. now rewrite real_mul, IH.
Qed.
Lemma with_slopes_times {A} between (hidden : list A) a u :
  with_slopes_R between hidden (a * u) = a * with_slopes_R between hidden u.
Proof.
  revert between. induction hidden as [|h hidden IH]; intros between; simpl; auto.
  unfold with_slopes_R in *. simpl. rewrite IH. ring.
Qed.
Lemma length_activated_alike a u v : length u = length v -> length (activated a u) = length (activated a v).
Proof.
  revert u v. induction a as [| | | | | | | |s|n a IH]; intros u v E; simpl; rewrite ?map_length; auto.
  - apply (related_length (fun _ _ => True)), related_sorted; auto. now apply any_numbers.
  - rewrite !app_length, !skipn_length, E. f_equal. apply IH. now rewrite !firstn_length, E.
Qed.
(** Of those that change and those that stay. *)
Lemma square_kept a n p q c c' : length p = length q -> 0 <= c -> c <= c' -> 1 <= c' ->
  square (minus (activated a (firstn n p)) (activated a (firstn n q)))
    <= c * c * square (minus (firstn n p) (firstn n q)) ->
  square (minus (activated (Keeping n a) p) (activated (Keeping n a) q)) <= c' * c' * square (minus p q).
Proof.
  intros E C L O H. assert (length (firstn n p) = length (firstn n q)) as F by now rewrite !firstn_length, E.
  change (apart (activated (Keeping n a) p) (activated (Keeping n a) q) <= c' * c' * apart p q).
  rewrite <- (firstn_skipn n p), <- (firstn_skipn n q) at 1. simpl. rewrite !firstn_skipn.
  change (square (minus _ _)) with (apart (activated a (firstn n p)) (activated a (firstn n q))) in H at 1.
  rewrite <- (firstn_skipn n p) at 3. rewrite <- (firstn_skipn n q) at 3.
  rewrite !apart_app by auto using length_activated_alike.
  pose proof (square_nonneg (minus (firstn n p) (firstn n q))) as P.
  pose proof (square_nonneg (minus (skipn n p) (skipn n q))) as Q. fold (apart (firstn n p) (firstn n q)) in *.
  fold (apart (skipn n p) (skipn n q)) in *. assert (c * c <= c' * c') by nra. assert (1 <= c' * c') by nra. nra.
Qed.
Lemma square_contracts a p q : length p = length q ->
  square (minus (activated a p) (activated a q)) <= real (steepest a) * real (steepest a) * square (minus p q).
Proof.
  assert (forall b p q, length p = length q ->
    square (minus (map (act b) p) (map (act b) q)) <= real (steepest b) * real (steepest b) * square (minus p q)) as M.
  { clear. intros b p q E. destruct (all_slopes b) as [C S]. now apply slopes_contract. }
  revert p q. induction a as [| | | | | | | |s|n a IH]; intros p q E; try (now apply M).
  - simpl. rewrite real_one, !Rmult_1_l. now apply sorting_contracts.
  - destruct (keeping_steepest n a). apply (square_kept a n p q (real (steepest a))); auto; [apply all_slopes|].
    apply IH. now rewrite !firstn_length, E.
Qed.
Lemma norm_from_square c u v : 0 <= c -> square u <= c * c * square v -> norm u <= c * norm v.
Proof.
  intros C H. unfold norm. rewrite <- (sqrt_square c) by auto. rewrite <- sqrt_mult_alt by nra. now apply sqrt_le_1_alt.
Qed.
Lemma activated_contracts a p q : length p = length q ->
  norm (minus (activated a p) (activated a q)) <= real (steepest a) * norm (minus p q).
Proof. intros E. apply norm_from_square; [apply all_slopes|now apply square_contracts]. Qed.
(** One layer and what follows it: `step` lengthens no difference by more than c. *)
Lemma layer_bound (step : list R -> list R) c w k u : 0 <= c -> 0 <= w ->
  (forall p q, length p = length q -> norm (minus (step p) (step q)) <= c * norm (minus p q)) ->
  norm_bound_of k u -> length (snd k) = length (fst k) -> forall x y,
  w * norm (minus (step (affine (fst (real_layer k)) (snd (real_layer k)) x))
                  (step (affine (fst (real_layer k)) (snd (real_layer k)) y))) <= c * (u * w) * norm (minus x y).
Proof.
  intros Hc W Hs Hu L x y. pose proof (affine_bound k u x y Hu L) as B.
  set (p := affine _ _ x) in *. set (q := affine _ _ y) in *.
  assert (length p = length q) as E.
  { unfold p, q, real_layer. simpl. rewrite !length_affine; auto; rewrite !map_length; apply L. }
  replace (c * (u * w) * norm (minus x y)) with (w * (c * (u * norm (minus x y)))) by ring.
  apply Rmult_le_compat_l; auto. eapply Rle_trans; [now apply Hs|]. now apply Rmult_le_compat_l.
Qed.
Lemma layers_bound between hs l us : Forall2 norm_bound_of (hs ++ [l]) us ->
  (forall k, In k (hs ++ [l]) -> length (snd k) = length (fst k)) -> forall x y,
  let g := layer_by_layer between (map real_layer hs) (real_layer l) in
  norm (minus (g x) (g y)) <= with_slopes_R between hs (product_R us) * norm (minus x y).
Proof.
  revert between us. induction hs as [|k hs IH]; intros between us H L x y; simpl in *.
  - inversion H as [|? u ? us' Hu Hus]; subst. inversion Hus; subst. simpl. unfold with_slopes_R. simpl.
    rewrite Rmult_1_r. apply affine_bound; auto.
  - inversion H as [|? u ? us' Hu Hus]; subst.
    eapply Rle_trans; [apply (IH (tl between) us'); auto|]. unfold with_slopes_R. simpl.
    change (fold_right _ (u * product_R us') _) with (with_slopes_R (tl between) hs (u * product_R us')).
    rewrite with_slopes_times.
    apply (layer_bound (activated (hd Relu between)) (real (steepest (hd Relu between))) _ k u); auto.
    + apply all_slopes.
    + apply with_slopes_nonneg. eapply product_nonneg; eauto.
    + intros p q E. now apply activated_contracts.
Qed.
Lemma part_bound ps accepted p v : Forall (holds ps) accepted -> fits_part (part_at ps p) = true ->
  norm_of ps accepted p = Some v -> 0 <= real v /\ forall x y,
  norm (minus (unclamped (part_at ps p) x) (unclamped (part_at ps p) y)) <= real v * norm (minus x y).
Proof.
  unfold norm_of. intros HA Hf Hv. destruct (norms accepted p 0 _) as [w|] eqn:Hw; [|discriminate].
  inversion Hv. destruct (norms_sound ps accepted p w HA _ [] eq_refl Hw) as (us & B & E).
  rewrite real_with_slopes, E. split.
  - apply with_slopes_nonneg. eapply product_nonneg; eauto.
  - apply layers_bound; auto. intros k. now apply fits_layer.
Qed.
Lemma square_in_largest m scale d : (scale = [] \/ length d = length scale) -> positive_scale scale = true ->
  real (hd one scale) <= m -> Forall (fun s => real s <= m) scale -> square d <= m * m * square_in scale d.
Proof.
  intros Hl Hs Hh Hm. destruct Hl as [->|Hl].
  - rewrite square_in_one. simpl in Hh. rewrite real_one in Hh. pose proof (square_nonneg d).
    assert (1 <= m * m) by nra. nra.
  - clear Hh. unfold square. revert scale Hl Hs Hm. induction d as [|a d IH]; intros [|s scale]; simpl;
      try discriminate; intros Hl Hs Hm; [lra|].
    inversion Hm as [|? ? Hms Hm']; subst. apply andb_prop in Hs. destruct Hs as [Hs Hs']. apply real_positive in Hs.
    specialize (IH scale ltac:(lia) Hs' Hm').
    assert (a * a <= m * m * (a / real s * (a / real s))); [|lra].
    assert (a = real s * (a / real s)) as E by (field; lra). set (q := a / real s) in *. rewrite E.
    replace (real s * q * (real s * q)) with (real s * real s * (q * q)) by ring.
    apply Rmult_le_compat_r; [pose proof (Rle_0_sqr q); auto|]. apply Rmult_le_compat; lra.
Qed.
Lemma norm_in_largest m scale moves c x y : 0 <= m -> agree moves x y -> (scale = [] \/ length scale = length moves) ->
  positive_scale scale = true -> real (hd one scale) <= m -> Forall (fun s => real s <= m) scale ->
  norm (minus (clamped c x) (clamped c y)) <= m * distance scale x y.
Proof.
  intros H0 Ha Hl Hs Hh Hm. destruct (agree_lengths _ _ _ Ha) as [Hx Hy]. unfold distance.
  rewrite <- (sqrt_square m) by auto. rewrite <- sqrt_mult_alt by nra. apply sqrt_le_1_alt.
  eapply Rle_trans; [apply (square_in_largest m scale); auto|].
  - rewrite length_minus by (rewrite !length_clamped; congruence). rewrite length_clamped. destruct Hl; [left|right];
      congruence.
  - apply Rmult_le_compat_l; [nra|]. apply square_in_clamped. congruence.
Qed.
Lemma moved_fits ps f moves scale : well_formed ps f moves scale = true -> fits_part (part_at ps (moved f)) = true.
Proof. unfold well_formed. intros H. do 4 both H. destruct f; simpl in *; now both H. Qed.
Lemma product_with_sound ps accepted f moves scale u a rest x y : Forall (holds ps) accepted ->
  check_product_with ps accepted f moves scale u (Some a) = true -> agree moves x y -> 0 <= real a ->
  (let p := part_at ps (moved f) in let c := clamped (clamp p) in
    norm (minus (value p x) (value p y)) <= real a * norm (minus (c x) (c y))) ->
  norm (minus (value_of ps f rest x) (value_of ps f rest y)) <= real u * distance scale x y.
Proof.
  intros HA. unfold check_product_with. set (m := largest _ _). intros H Ha Ka Ba. do 3 both H.
  unfold well_formed in H. do 4 both H. rename H3 into Hl, H4 into Hs, H6 into Hc.
  destruct (behind_of ps accepted f) as [b|] eqn:Hb; [|discriminate]. apply at_most_real in H0, H2.
  rewrite !real_mul in H0.
  assert (Forall (fun s => real s <= real m) scale) as Hm.
  { rewrite forallb_forall in H1. apply Forall_forall. intros s G. now apply at_most_real, H1. }
  destruct (positive_hd _ Hs) as [Hp _].
  assert (scale = [] \/ length scale = length moves) as Hl'.
  { apply orb_prop in Hl. destruct Hl as [G|G]; [left; now destruct scale|right; now apply Nat.eqb_eq]. }
  assert (forall c, norm (minus (clamped c x) (clamped c y)) <= real m * distance scale x y) as D
    by (intros c; apply (norm_in_largest _ _ moves); auto; lra).
  pose proof (distance_nonneg scale x y) as Dn.
  set (first := norm (minus (value (part_at ps (moved f)) x) (value (part_at ps (moved f)) y))) in *.
  assert (first <= real a * (real m * distance scale x y)) as F
    by (eapply Rle_trans; [exact Ba|]; now apply Rmult_le_compat_l).
  assert (forall e, 0 <= real b -> e <= real b * first -> e <= real u * distance scale x y) as G.
  { intros e K E. apply Rle_trans with (real b * (real a * (real m * distance scale x y))).
    - eapply Rle_trans; [exact E|]. now apply Rmult_le_compat_l.
    - replace (real b * (real a * (real m * distance scale x y))) with (real m * (real a * real b) * distance scale x y)
        by ring. now apply Rmult_le_compat_r. }
  destruct f as [p|phi r]; cbn [parts_of forallb tl value_of behind_of moved] in *.
  - inversion Hb as [E]. rewrite <- E, real_one in G. apply G; [lra|]. rewrite Rmult_1_l. apply Rle_refl.
  - both H. both H3. both Hc. destruct (part_bound _ _ _ _ HA H3 Hb) as [Kb Bb].
    unfold value at 1 3. destruct (clamp (part_at ps r)) eqn:E; [|discriminate]. simpl clamped. apply G; auto.
    eapply Rle_trans; [apply Bb|]. apply Rmult_le_compat_l; auto. apply norm_le. unfold first, norm.
    rewrite square_shifted by (now rewrite !length_value). apply Rle_refl.
Qed.
Lemma product_sound ps accepted f moves scale u : Forall (holds ps) accepted ->
  check_product ps accepted f moves scale u = true -> holds ps (Slope_at_most f moves scale u).
Proof.
  intros HA H rest x y Ha _. unfold check_product in H. destruct (norm_of ps accepted (moved f)) as [a|] eqn:E.
  - pose proof H as W. unfold check_product_with in W. do 3 both W. apply moved_fits in W.
    destruct (part_bound _ _ _ _ HA W E) as [K B]. apply (product_with_sound _ _ _ _ _ _ _ _ _ _ HA H Ha K). apply B.
  - unfold check_product_with in H. both H. discriminate.
Qed.

(** By the slopes in a box *)
Lemma contracts_in (a : activation) c t p q d e : 0 <= c ->
  (forall n, In n t -> let (l, h) := slopes_between a (fst n) in real h <= c /\ - real l <= c) ->
  is_entrywise a = true -> Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  square (minus (map (act a) p) (map (act a) q)) <= c * c * square (minus p q).
Proof.
  intros C H E P. revert q. unfold square, minus. induction P as [|n y t p [L _] P IH]; intros q G; inversion G as
    [|? z ? q' [M _] G']; subst; simpl; [lra|].
  assert (forall n, In n t -> let (l, h) := slopes_between a (fst n) in real h <= c /\ - real l <= c) as H'
    by (intros; apply H; now right). specialize (IH H' q' G'). specialize (H n (or_introl eq_refl)).
  pose proof (slopes_between_hold a (fst n) E) as S. destruct (slopes_between a (fst n)) as [l h]. cbn [fst snd] in S.
  destruct H as [Hh Hl], L as [L1 L2], M as [M1 M2].
  assert (forall u v, real (fst (fst n)) <= u -> u <= v -> v <= real (snd (fst n)) ->
    (act a v - act a u) * (act a v - act a u) <= c * c * ((v - u) * (v - u))) as K.
  { intros u v U V W. destruct (S u v U V W) as [S1 S2].
    assert (- (c * (v - u)) <= act a v - act a u <= c * (v - u)) by nra.
    replace (c * c * ((v - u) * (v - u))) with ((c * (v - u)) * (c * (v - u))) by ring. nra. }
  assert ((act a y + -1 * act a z) * (act a y + -1 * act a z) <= c * c * ((y + -1 * z) * (y + -1 * z))) as Y.
  { destruct (Rle_lt_dec z y) as [O|O]; [specialize (K z y M1 O L2)|specialize (K y z L1 ltac:(lra) M2)]; lra. }
  lra.
Qed.
Lemma steepest_known_above a t : is_entrywise a = true -> 0 <= real (steepest_known a t) /\
  forall n, In n t -> let (l, h) := slopes_between a (fst n) in
    real h <= real (steepest_known a t) /\ - real l <= real (steepest_known a t).
Proof.
  intros E. assert (steepest_known a t =
    fold_right (fun n m => let (l, h) := slopes_between a (fst n) in larger (larger h (neg l)) m) zero t) as ->
    by (destruct a; auto; discriminate).
  induction t as [|n t [P IH]]; simpl; [rewrite real_zero; split; [lra|tauto]|].
  set (m := fold_right _ _ _) in *. destruct (slopes_between a (fst n)) as [l h] eqn:S.
  rewrite !real_larger, real_neg. pose proof (Rmax_l (Rmax (real h) (- real l)) (real m)).
  pose proof (Rmax_r (Rmax (real h) (- real l)) (real m)). pose proof (Rmax_l (real h) (- real l)).
  pose proof (Rmax_r (real h) (- real l)). split; [lra|]. intros k [<-|I]; [rewrite S; lra|].
  specialize (IH k I). destruct (slopes_between a (fst k)). lra.
Qed.
Lemma square_contracts_in a t p q d e : Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  let c := real (steepest_known a t) in 0 <= c /\
  square (minus (activated a p) (activated a q)) <= c * c * square (minus p q).
Proof.
  assert (forall b t p q, is_entrywise b = true -> Forall2 (follows d) t p -> Forall2 (follows e) t q ->
    let c := real (steepest_known b t) in 0 <= c /\
    square (minus (map (act b) p) (map (act b) q)) <= c * c * square (minus p q)) as M.
  { clear. intros b t p q E P G. destruct (steepest_known_above b t E) as [C H]. split; auto.
    now apply (contracts_in b _ t p q d e). }
  revert t p q. induction a as [| | | | | | | |s|n a IH]; intros t p q P G; try (now apply M);
    assert (length p = length q) as E by now rewrite <- (related_length _ _ _ P), <- (related_length _ _ _ G).
  - simpl. rewrite real_one, !Rmult_1_l. split; [lra|]. now apply sorting_contracts.
  - destruct (IH (firstn n t) (firstn n p) (firstn n q)) as [C B]; try now apply related_firstn.
    cbn [steepest_known]. rewrite real_larger, real_one. set (c := real (steepest_known a (firstn n t))) in *.
    pose proof (Rmax_l 1 c). pose proof (Rmax_r 1 c). split; [lra|]. now apply (square_kept a n p q c).
Qed.
Lemma activated_contracts_in a t p q d e : Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  0 <= real (steepest_known a t) /\
  norm (minus (activated a p) (activated a q)) <= real (steepest_known a t) * norm (minus p q).
Proof.
  intros P G. destruct (square_contracts_in a t p q d e P G) as [C H]. split; auto. now apply norm_from_square.
Qed.
Lemma centred_layers_bound radius d e between hs l us s : bounded_by radius d -> bounded_by radius e ->
  Forall2 norm_bound_of (hs ++ [l]) us ->
  (forall k, In k (hs ++ [l]) -> length (snd k) = length (fst k)) -> forall x y,
  Forall2 (follows d) s x -> Forall2 (follows e) s y ->
  let g := layer_by_layer between (map real_layer hs) (real_layer l) in
  let c := real (steepest_centred radius (rounding_of radius) between hs s) in
  0 <= c /\ norm (minus (g x) (g y)) <= c * product_R us * norm (minus x y).
Proof.
  intros D E. revert between us s. induction hs as [|k hs IH]; intros between us s H L x y X Y; simpl in *.
  - inversion H as [|? u ? us' Hu Hus]; subst. inversion Hus; subst. simpl. rewrite real_one, Rmult_1_r, Rmult_1_l.
    split; [lra|]. apply affine_bound; auto.
  - inversion H as [|? u ? us' Hu Hus]; subst. set (a := hd Relu between).
    set (t := passed radius (rounding_of radius) (fst k) (snd k) s).
    set (p := affine (fst (real_layer k)) (snd (real_layer k)) x).
    set (q := affine (fst (real_layer k)) (snd (real_layer k)) y).
    assert (Forall2 (follows d) t p) as P by (apply passed_follow; auto).
    assert (Forall2 (follows e) t q) as G by (apply passed_follow; auto).
    destruct (activated_contracts_in a t p q d e P G) as [C B].
    destruct (IH (tl between) us' (activated_known a (rounding_of radius) t) Hus ltac:(auto) (activated a p)
      (activated a q) ltac:(now apply activated_known_follow) ltac:(now apply activated_known_follow)) as [C' B'].
    pose proof (product_nonneg _ _ Hus) as Up. pose proof (affine_bound k u x y Hu ltac:(auto)) as F. fold p q in F.
    rewrite real_mul. split; [now apply Rmult_le_pos|]. eapply Rle_trans; [exact B'|].
    set (c := real (steepest_known a t)) in *. set (c' := real (steepest_centred _ _ _ _ _)) in *.
    apply Rle_trans with (c' * product_R us' * (c * (u * norm (minus x y)))).
    + apply Rmult_le_compat_l; [now apply Rmult_le_pos|]. eapply Rle_trans; [exact B|]. now apply Rmult_le_compat_l.
    + right. simpl. ring.
Qed.
Lemma local_product_sound ps accepted f moves scale b u : Forall (holds ps) accepted ->
  check_local_product ps accepted f moves scale b u = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  intros HA H rest x y Ha _ X Y. unfold check_local_product in H.
  set (p := part_at ps (moved f)) in *. destruct (norms accepted (moved f) 0 (layers p)) as [v|] eqn:E.
  2: { unfold check_product_with in H. both H. discriminate. }
  simpl option_map in H. pose proof H as W. unfold check_product_with in W. do 3 both W. apply moved_fits in W.
  fold p in W. destruct (norms_sound ps accepted (moved f) v HA _ [] eq_refl E) as (us & B & Ev).
  apply (within_clamped (clamp p)) in X, Y.
  destruct (inputs_follow _ _ X) as (d & D & _ & F). destruct (inputs_follow _ _ Y) as (e & D' & _ & F').
  specialize (F O [] eq_refl). specialize (F' O [] eq_refl).
  destruct (centred_layers_bound _ d e (between p) (hidden p) (outer p) us _ D D' B
    (fun k => fits_layer p k W) _ _ F F') as [C N].
  apply (product_with_sound _ _ _ _ _ _ _ _ _ _ HA H Ha); rewrite real_mul, Ev.
  - apply Rmult_le_pos; [exact C|]. eapply product_nonneg; eauto.
  - exact N.
Qed.

(** By a matrix inequality with these slopes *)
Definition undivided_stack (p : part) : real_stack :=
  (functions_and_layers (between p) (map real_layer (hidden p)), real_layer (outer p)).
Lemma undivided_value p x : fits_part p = true -> chained_between p = true ->
  value p x = run (undivided_stack p) (clamped (clamp p) x).
Proof. intros F H. unfold value. now rewrite unclamped_network. Qed.
Lemma undivided_instance p : fits_part p = true -> instance (undivided_matrices p) (undivided_stack p).
Proof.
  intros H. assert (forall l, In l (layers p) -> of_matrix (fst l) (real_layer l)) as F.
  { intros l Hl. split; [reflexivity|]. simpl. rewrite map_length. now apply (fits_layer p). }
  split; [|apply F; unfold layers; apply in_or_app; right; now left].
  unfold undivided_matrices, undivided_stack, functions_and_layers. cbn [fst].
  assert (forall l, In l (hidden p) -> of_matrix (fst l) (real_layer l)) as G
    by (intros; apply F; unfold layers; apply in_or_app; now left).
  clear F. generalize (between p) as s. induction (hidden p) as [|l ls IH]; intros s; cbn; constructor.
  - split; [apply G; now left|]. apply in_groups_keep_length. intros a y. apply length_by_number.
  - apply IH. intros. apply G. now right.
Qed.
Lemma undivided_along p x x' : fits_part p = true -> chained_between p = true ->
  along (fst (undivided_stack p)) (real_relations (relations_by whole_ranges p)) x x'.
Proof.
  intros H C. destruct (undivided_instance p H) as [I _].
  apply along_everywhere; [now apply (stages_fit (fst (undivided_matrices p)))|]. revert C. clear.
  unfold relations_by, undivided_stack, functions_and_layers, chained_between. cbn [fst]. generalize (between p) as s.
  induction (hidden p) as [|l ls IH]; intros s C; cbn in C |- *; constructor; apply andb_prop in C; [|now apply IH].
  cbn [fst snd weights real_layer]. intros y y' L L'. rewrite map_length in L, L'.
  apply (related_in_groups _ whole_ranges _ (fst l)); try tauto. intros _.
  apply (increments_by_number _ _ _ (fun _ _ => True) (fun _ _ => True)); auto using any_numbers.
  - intros _ u u' _ _. apply slope_increment, range_holds.
  - intros _. apply kept_range_has_one.
Qed.
Lemma whole_entrywise a y : changes_numbers a = true -> whole a y = whole_by_number a y.
Proof. destruct a as [| | | | | | | |[k| |]|]; try discriminate; reflexivity. Qed.
Lemma increments_in a t p q d e : changes_numbers a = true -> Forall2 (follows d) t p -> Forall2 (follows e) t q ->
  increments_within (map real_range (slopes_known a t)) p q (whole_by_number a p) (whole_by_number a q).
Proof.
  intros E. apply increments_by_number; [|intros; apply kept_range_has_one].
  intros n y z [[L1 L2] _] [[M1 M2] _]. pose proof (slopes_between_hold (base a) (fst n) E) as S.
  unfold increment_within, real_range. cbn [fst snd].
  destruct (Rle_lt_dec y z) as [O|O]; [specialize (S y z L1 O M2)|specialize (S z y M1 ltac:(lra) L2)]; nra.
Qed.
Lemma centred_along radius d e between hs s : bounded_by radius d -> bounded_by radius e ->
  forallb changes_numbers between = true ->
  (forall k, In k hs -> length (snd k) = length (fst k)) -> forall x y,
  Forall2 (follows d) s x -> Forall2 (follows e) s y ->
  along (functions_and_layers between (map real_layer hs))
    (real_relations (map Each (ranges_centred radius (rounding_of radius) between hs s))) x y.
Proof.
  intros D E. revert between s. induction hs as [|k hs IH]; intros between s N L x y X Y; cbn; auto.
  set (a := hd Relu between).
  destruct (entrywise_first between N) as [A' N']. fold a in A'.
  pose proof (passed_follow radius d (fst k) (snd k) s x D (L k (or_introl eq_refl)) X) as P.
  pose proof (passed_follow radius e (fst k) (snd k) s y E (L k (or_introl eq_refl)) Y) as G.
  assert (forall z, activated a z = whole a z) as M.
  { intros z. rewrite (whole_activated a z z); auto. destruct a as [| | | | | | | |[k'| |]|]; try discriminate;
    exact A'. }
  split.
  - cbn [related real_relation]. rewrite !whole_entrywise by auto. now apply (increments_in a _ _ _ d e).
  - apply IH; auto; [intros; apply L; now right| |]; rewrite <- M; now apply activated_known_follow.
Qed.
Lemma local_slope_sound ps f moves scale b u rho t factor :
  check_local_slope ps f moves scale b u rho t factor = true -> holds ps (Slope_in_box f moves scale b u).
Proof.
  unfold check_local_slope. intros H rest x y Ha _ X Y. do 3 both H. rename H2 into He.
  assert (forallb chained_between (parts_of ps f) = true) as H2.
  { rewrite forallb_forall in He |- *. intros p Hp. now apply entrywise_chained, He. }
  apply (chain_sound ps f moves scale u rho t factor undivided_matrices undivided_stack _ rest x y H H2 H1 H0
    undivided_instance undivided_value Ha).
  pose proof (moved_fits _ _ _ _ H) as W. set (p := part_at ps (moved f)) in *.
  assert (entrywise_between p = true) as N by (destruct f; cbn in He; now both He).
  apply (within_clamped (clamp p)) in X, Y.
  destruct (inputs_follow _ _ X) as (d & D & _ & F). destruct (inputs_follow _ _ Y) as (e & D' & _ & F').
  specialize (F O [] eq_refl). specialize (F' O [] eq_refl).
  assert (along (fst (undivided_stack p)) (real_relations (map Each (ranges_on_box p b))) (clamped (clamp p) x)
    (clamped (clamp p) y))
    as A.
  { apply (centred_along _ d e); auto. intros k K. apply (fits_layer p k W). unfold layers. apply in_or_app. now left. }
  unfold local_relations, p in *. destruct f as [q|phi k]; cbn [stacks_of moved along_after] in *; rewrite !plus_nil_r.
  - now split.
  - split; auto. split; auto. unfold well_formed in H. do 4 both H. cbn in H, H2.
    apply andb_prop in H, H2. destruct H as [_ H], H2 as [_ H2]. apply andb_prop in H, H2. now apply undivided_along.
Qed.
